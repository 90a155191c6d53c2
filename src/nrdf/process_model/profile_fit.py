"""A spray profile from measured strips: film thickness across one straight pass over a plate."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from nrdf.errors import ProcessError
from nrdf.io.files import read_file
from nrdf.process_model.spray_profile import Shape, SprayProfile

COLUMNS = ("offset_mm", "thickness_um")
_FEWEST, _LARGEST = 6, 1 << 22
_HIGH = 0.02  # of the largest thickness, above which film counts


@dataclass(frozen=True)
class Strip:
    """A measured strip. offset_m: (n,) across the pass, from anywhere; thickness_m: (n,); feed_m_s:
    of the gun, once over the plate."""

    offset_m: np.ndarray
    thickness_m: np.ndarray
    feed_m_s: float


@dataclass(frozen=True)
class FittedProfile:
    """A profile, where the strip's middle was, m, and how far off the fit is: the root of the mean
    square, for the largest thickness."""

    profile: SprayProfile
    middle_m: float
    error: float


def read_strip(path: str | Path, feed_m_s: float) -> Strip:
    """A strip from a CSV file with the columns offset_mm and thickness_um.

    Raises ProcessError where the file has not these, or no film in it.
    """
    text = read_file(Path(path), ProcessError, _LARGEST).decode("utf-8-sig", "replace")
    rows = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    reader = csv.DictReader(rows, skipinitialspace=True)
    names = [str(name).strip() for name in reader.fieldnames or ()]
    reader.fieldnames = names
    if not set(COLUMNS) <= set(names):
        raise ProcessError(
            f"{path} has the columns {', '.join(names) or 'of no name'}; a measured strip needs "
            f"{' and '.join(COLUMNS)}"
        )
    values = []
    for number, row in enumerate(reader, 2):
        try:
            values.append([float(row[name]) for name in COLUMNS])
        except (TypeError, ValueError):
            raise ProcessError(
                f"{path}, row {number}: {row[COLUMNS[0]]!r}, {row[COLUMNS[1]]!r} are no two numbers"
            ) from None
    given = np.array(values, float).reshape(-1, 2)
    if not np.isfinite(given).all():
        raise ProcessError(f"{path}: offsets and thicknesses must be finite")
    order = np.argsort(given[:, 0], kind="stable")
    strip = Strip(1e-3 * given[order, 0], 1e-6 * given[order, 1], feed_m_s)
    check_strip(strip, str(path))
    return strip


def check_strip(strip: Strip, origin: str) -> None:
    """Raise ProcessError for a strip that no profile can be told from."""
    if not 1e-4 <= strip.feed_m_s <= 10.0:
        raise ProcessError(f"a feed of {strip.feed_m_s:g} m/s; give that of the measured pass")
    high = strip.thickness_m > _HIGH * strip.thickness_m.max(initial=0.0)
    if strip.thickness_m.max(initial=0.0) <= 0.0 or len(np.unique(strip.offset_m[high])) < _FEWEST:
        raise ProcessError(
            f"{origin}: film at {int(high.sum())} offsets; a profile needs {_FEWEST} or more "
            "different ones with film, and some beside it"
        )


def fit_profile(
    across: Strip,
    standoff_m: float,
    shape: Shape = "beta",
    along: Strip | None = None,
    roundness: float = 1.0,
) -> FittedProfile:
    """The profile whose strip comes nearest to a measured one, by least squares.

    across: measured with the gun held as it will be. along: a second strip, with the gun turned by
    90° about its axis, which tells the other half-width; without it that is `roundness` times the
    first. Raises ProcessError for strips that no profile can be told from.
    """
    if not 0.01 <= roundness <= 100.0:
        raise ProcessError(f"a roundness of {roundness:g}; give 0.01 to 100, 1 for a round fan")
    wide, exponent, middle, area, error = _fit(across, shape)
    narrow, other = roundness * wide, exponent
    if along is not None:
        narrow, other, _, _, _ = _fit(along, shape)
    # A strip's area times the feed is the flow. A strip's exponent is half more than the flux's.
    profile = SprayProfile(
        across_m=wide,
        along_m=narrow,
        flow_m3_s=area * across.feed_m_s,
        standoff_m=standoff_m,
        shape=shape,
        across_exponent=max(exponent + 0.5, 1.0) if shape == "beta" else 2.0,
        along_exponent=max(other + 0.5, 1.0) if shape == "beta" else 2.0,
    )
    return FittedProfile(profile, middle, error)


def _fit(strip: Strip, shape: Shape) -> tuple[float, float, float, float, float]:
    """Half-width, exponent of the strip, middle, area (m²) and error of a strip."""
    check_strip(strip, "the strip")
    x, film = strip.offset_m, strip.thickness_m / strip.thickness_m.max()
    total = float(np.maximum(film, 0.0).sum())
    middle = float((np.maximum(film, 0.0) * x).sum() / total)
    high = x[film > _HIGH]
    half = max(0.5 * float(np.ptp(high)), 1e-4)

    def curve(p: np.ndarray) -> np.ndarray:
        away = ((x - p[1]) / p[0]) ** 2
        if shape == "gaussian":
            return np.asarray(p[2] * np.exp(-0.5 * away))
        return np.asarray(p[2] * np.maximum(1.0 - away, 0.0) ** p[3])

    start = [half if shape == "beta" else 0.4 * half, middle, 1.0, 2.0]
    low = [1e-4, middle - half, 0.1, 0.5]
    top = [10.0 * half + 1e-3, middle + half, 3.0, 49.0]
    found = least_squares(
        lambda p: curve(p) - film,
        np.clip(start, low, top),
        bounds=(low, top),
        x_scale=[half, half, 1.0, 2.0],
    )
    wide, at, height, exponent = (float(value) for value in found.x)
    fine = np.linspace(-1.0, 1.0, 4001)
    form = np.maximum(1.0 - fine**2, 0.0) ** exponent
    across = float(np.trapezoid(form, fine)) if shape == "beta" else float(np.sqrt(2.0 * np.pi))
    area = height * wide * across * float(strip.thickness_m.max())
    return wide, exponent, at, area, float(np.sqrt((found.fun**2).mean()))
