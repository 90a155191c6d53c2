"""How well a tool path works its region: the figures of the report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nrdf.process.plan import Strategy
from nrdf.process.surface import Surface
from nrdf.process.toolpath import Segment


@dataclass(frozen=True)
class Measures:
    """Figures of one tool path on one region.

    coverage: share [0, 1] of the region's area inside its margin that the footprint reaches;
    overlap: share of what is reached that neighbouring lines reach twice or more, in one pass;
    line_spacing_*: along the surface, None where there is only one line; surface_distance_*: of
    the process waypoints from the local smooth surface at the stand-off asked for, the worst and
    the 99th percentile; axis_error_99_rad: 99th percentile of the angle between the tool axis and
    the one asked for. process_length_m: of the process segments, path_length_m: of all, free moves
    between them included; cycle_time_s: at the feeds given, with dwells.
    """

    coverage: float
    overlap: float
    line_spacing_mean_m: float | None
    line_spacing_worst_m: float | None
    surface_distance_worst_m: float
    surface_distance_99_m: float
    axis_error_99_rad: float
    path_length_m: float
    process_length_m: float
    cycle_time_s: float


def measure(
    surface: Surface, region: np.ndarray, strategy: Strategy, segments: Sequence[Segment]
) -> Measures:
    """Figures of `segments` on `region`, indices (k,) of the surface's points."""
    raise NotImplementedError
