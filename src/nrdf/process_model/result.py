"""What a process leaves on its region: how even, how much within the tolerance, what is wasted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nrdf.errors import ProcessError


@dataclass(frozen=True)
class Target:
    """The film or depth that is wanted, m, and how far off it may be."""

    value_m: float
    tolerance_m: float

    def __post_init__(self) -> None:
        if not 0.0 < self.value_m < 1.0:
            raise ProcessError(f"a target of {1e6 * self.value_m:g} µm; give one above 0")
        if not 0.0 < self.tolerance_m < self.value_m:
            raise ProcessError(
                f"a tolerance of {1e6 * self.tolerance_m:g} µm on {1e6 * self.value_m:g} µm; give "
                "one above 0 and below the target"
            )


@dataclass(frozen=True)
class ResultMetrics:
    """Of the film or depth on a region, by area.

    mean_m, least_m, most_m: the last two without 0.5 % of the area at either end. variation:
    standard deviation over the mean. within, below, above: shares of the area within the tolerance,
    and on either side. overspray: share of what was laid that did not land on the region; 0 for
    removal. beside: share that landed on other faces of the object. seconds: on the surface.
    """

    mean_m: float
    least_m: float
    most_m: float
    variation: float
    within: float
    below: float
    above: float
    overspray: float
    beside: float
    seconds: float


def measure_result(
    values_m: np.ndarray,
    areas_m2: np.ndarray,
    target: Target,
    spent_m3: float = 0.0,
    beside_m3: float = 0.0,
    seconds: float = 0.0,
) -> ResultMetrics:
    """Metrics of film or depth (n,), m, on cells of areas (n,), m².

    spent_m3: all that left the gun, 0 for removal; beside_m3: what of it lies on other faces.
    """
    share = areas_m2 / areas_m2.sum()
    mean = float(share @ values_m)
    spread = float(np.sqrt(share @ (values_m - mean) ** 2))
    order = np.argsort(values_m)
    summed = np.cumsum(share[order])
    least, most = (values_m[order[min(int(np.searchsorted(summed, q)), len(order) - 1)]]
                   for q in (0.005, 0.995))  # fmt: skip
    low, high = target.value_m - target.tolerance_m, target.value_m + target.tolerance_m
    below, above = float(share[values_m < low].sum()), float(share[values_m > high].sum())
    landed = float(areas_m2 @ values_m)
    return ResultMetrics(
        mean_m=mean,
        least_m=float(least),
        most_m=float(most),
        variation=spread / mean if mean > 0.0 else 0.0,
        within=1.0 - below - above,
        below=below,
        above=above,
        overspray=max(1.0 - landed / spent_m3, 0.0) if spent_m3 > 0.0 else 0.0,
        beside=beside_m3 / spent_m3 if spent_m3 > 0.0 else 0.0,
        seconds=seconds,
    )
