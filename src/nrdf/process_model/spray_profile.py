"""A spray gun's profile: how much film it lays where, on a plate at its stand-off.

Two shapes that the field uses: the elliptical Gaussian, and the bivariate beta distribution (Balkan
and Arikan, "Modeling of paint flow rate flux for circular paint sprays by using experimental paint
distribution data", 1999; elliptical as in Zhang et al. and Chen et al.).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.special import beta as beta_function

from nrdf.errors import ProcessError

Shape = Literal["beta", "gaussian"]
_CUT = 3.5  # standard deviations at which a Gaussian ends: 0.2 % of it lie beyond
_LEAST_M, _MOST_M = 1e-4, 2.0
_LEAST_EXPONENT, _MOST_EXPONENT = 1.0, 50.0


@dataclass(frozen=True)
class SprayProfile:
    """A gun's flux on a plate at its stand-off, square to its axis.

    across_m, along_m: half-widths across the travel (tool y) and along it (tool x): where a beta
    profile ends, the standard deviation of a Gaussian. flow_m3_s: solid film that reaches a plate
    wider than the fan, each second: what losses leave of it. standoff_m: from the tool centre point
    to that plate. across_exponent, along_exponent: of a beta profile, at least 1; 1 is a box.
    Raises ProcessError for values that no gun has, naming them.
    """

    across_m: float
    along_m: float
    flow_m3_s: float
    standoff_m: float
    shape: Shape = "beta"
    across_exponent: float = 2.0
    along_exponent: float = 2.0

    def __post_init__(self) -> None:
        for name in ("across_m", "along_m", "standoff_m"):
            value = getattr(self, name)
            if not _LEAST_M <= value <= _MOST_M:
                raise ProcessError(
                    f"a spray profile with {name} of {value:g}; give {_LEAST_M:g} to {_MOST_M:g} m"
                )
        if not 0.0 < self.flow_m3_s < 1.0:
            raise ProcessError(
                f"a spray profile with flow_m3_s of {self.flow_m3_s:g}; give a flow above 0, and "
                "below 1 m³/s"
            )
        for name in ("across_exponent", "along_exponent"):
            value = getattr(self, name)
            if not _LEAST_EXPONENT <= value <= _MOST_EXPONENT:
                raise ProcessError(
                    f"a spray profile with {name} of {value:g}; give {_LEAST_EXPONENT:g} to "
                    f"{_MOST_EXPONENT:g}"
                )
        if self.shape not in ("beta", "gaussian"):
            raise ProcessError(f"no spray profile is called {self.shape!r}; beta or gaussian")

    @property
    def ends_m(self) -> tuple[float, float]:
        """Half-widths across and along beyond which nothing falls, at the stand-off, m."""
        times = 1.0 if self.shape == "beta" else _CUT
        return times * self.across_m, times * self.along_m

    @property
    def peak_m_s(self) -> float:
        """Film a second in the middle, m/s."""
        if self.shape == "gaussian":
            return self.flow_m3_s / (2.0 * np.pi * self.across_m * self.along_m)
        both = beta_function(0.5, self.along_exponent) * beta_function(
            0.5, self.across_exponent + 0.5
        )
        return float(self.flow_m3_s / (self.across_m * self.along_m * both))

    def flux(self, across: np.ndarray, along: np.ndarray) -> np.ndarray:
        """Film a second, m/s, at places (n,), m, of the plate."""
        x, y = (across / self.across_m) ** 2, (along / self.along_m) ** 2
        if self.shape == "gaussian":
            inside = np.maximum(x, y) <= _CUT**2
            return np.asarray(np.where(inside, self.peak_m_s * np.exp(-0.5 * (x + y)), 0.0))
        rest = np.maximum(1.0 - x, 1e-12)
        beside = np.maximum(1.0 - y / rest, 0.0)
        lies = (x < 1.0) & (y < rest)
        found = rest ** (self.across_exponent - 1.0) * beside ** (self.along_exponent - 1.0)
        return np.asarray(np.where(lies, self.peak_m_s * found, 0.0))

    def strip(self, across: np.ndarray, feed_m_s: float) -> np.ndarray:
        """Film (n,), m, that one straight pass leaves on a plate, `across` (n,) m from its middle:
        the flux integrated along the travel, in closed form."""
        x = (np.asarray(across, float) / self.across_m) ** 2
        if self.shape == "gaussian":
            wide = self.along_m * np.sqrt(2.0 * np.pi)
            return np.asarray(
                np.where(x <= _CUT**2, self.peak_m_s * wide * np.exp(-0.5 * x) / feed_m_s, 0.0)
            )
        wide = self.along_m * float(beta_function(0.5, self.along_exponent))
        rest = np.maximum(1.0 - x, 0.0)
        return np.asarray(self.peak_m_s * wide * rest ** (self.across_exponent - 0.5) / feed_m_s)
