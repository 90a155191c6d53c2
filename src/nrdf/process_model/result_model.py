"""One tool path on one region: what it leaves there at any feeds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_matrix

from nrdf.process_model.cells import Cells
from nrdf.process_model.deposition import deposition
from nrdf.process_model.moves import Moves
from nrdf.process_model.removal import Pad, removal
from nrdf.process_model.result import ResultMetrics, Target, measure_result
from nrdf.process_model.spray_profile import SprayProfile
from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.types import Segment

_CELL, _STEP = 3.0, 4.0  # cells and samples of the way along the shorter half-width or radius
_AROUND = 1.5  # half-widths or radii around a region that are looked at

Tool = SprayProfile | Pad


@dataclass(frozen=True)
class ResultModel:
    """Film or depth of a tool path, linear in the slowness of its moves.

    cells: of the region and around it; moves: of the path. matrix: (n, m), m²; fixed: (n,), m, what
    dwells leave. flow_m3_s: what leaves the gun, 0 for a pad.
    """

    cells: Cells
    moves: Moves
    matrix: csr_matrix
    fixed: np.ndarray
    flow_m3_s: float

    @staticmethod
    def of(
        region: RegionMesh,
        segments: Sequence[Segment],
        tool: Tool,
        cells: Cells | None = None,
        times: float = 1.0,
    ) -> ResultModel:
        """cells: of the region, where they are known already; times: how often as long the steps
        along the way are. Raises ProcessError where the path has no process segment."""
        cells = cells_for(region, tool) if cells is None else cells
        wide = min(tool.ends_m) if isinstance(tool, SprayProfile) else tool.radius_m
        moves = Moves.of(segments, times * wide / _STEP)
        count, stops = len(moves.lengths_m), len(moves.stops.weights)
        if isinstance(tool, SprayProfile):
            blocking = region.parent
            matrix = deposition(cells, moves.samples, count, tool, blocking)
            dwells = deposition(cells, moves.stops, stops, tool, blocking)
            flow = tool.flow_m3_s
        else:
            # Beyond an edge a pad is held where it was planned, and presses nothing.
            samples = moves.samples.select(moves.pressed[moves.samples.column])
            matrix = removal(cells, samples, count, tool, moves.feeds_m_s[samples.column])
            dwells = removal(cells, moves.stops.select(moves.stops_pressed), stops, tool, 0.0)
            flow = 0.0
        fixed = np.asarray(dwells.sum(axis=1)).ravel()
        return ResultModel(cells, moves, matrix, fixed, flow)

    @property
    def on_region(self) -> csr_matrix:
        """The matrix's rows (k, m) of the region's cells, which come first."""
        return self.matrix[: self.region_cells]

    @property
    def region_cells(self) -> int:
        """How many cells are the region's."""
        return int(self.cells.inside.sum())

    @property
    def region_areas_m2(self) -> np.ndarray:
        """Areas (k,) of the region's cells, m²."""
        return self.cells.areas_m2[self.cells.inside]

    def values(self, feeds_m_s: np.ndarray | None = None) -> np.ndarray:
        """Film or depth (n,), m, of all cells, at feeds (m,) of the moves or at the path's own."""
        feeds = self.moves.feeds_m_s if feeds_m_s is None else feeds_m_s
        return np.asarray(self.matrix @ (1.0 / feeds) + self.fixed)

    def spill_m3(self) -> np.ndarray:
        """What each move (m,) leaves elsewhere, m³ for each second a metre: beside the region and
        in the air; none for a pad."""
        if self.flow_m3_s == 0.0:
            return np.zeros(len(self.moves.lengths_m))
        landed = self.region_areas_m2 @ self.on_region
        return np.asarray(np.maximum(self.flow_m3_s * self.moves.lengths_m - landed, 0.0))

    def measure(self, target: Target, feeds_m_s: np.ndarray | None = None) -> ResultMetrics:
        """Metrics at feeds (m,), or at the path's own."""
        feeds = self.moves.feeds_m_s if feeds_m_s is None else feeds_m_s
        values = self.values(feeds)
        seconds = float((self.moves.lengths_m / feeds).sum() + self.moves.stops.weights.sum())
        inside = self.cells.inside
        return measure_result(
            values[inside],
            self.region_areas_m2,
            target,
            self.flow_m3_s * seconds,
            float(self.cells.areas_m2[~inside] @ values[~inside]) if self.flow_m3_s else 0.0,
            seconds,
        )


def cells_for(region: RegionMesh, tool: Tool, rough: bool = False) -> Cells:
    """Cells that are small to a tool, of a region and what lies around it; rough: for a first look,
    of the region alone."""
    if isinstance(tool, SprayProfile):
        small, large = min(tool.ends_m), max(tool.ends_m)
    else:
        small = large = tool.radius_m
    if rough:
        return Cells.rough(region, small / _CELL)
    return Cells.of(region, small / _CELL, _AROUND * large)


def with_feeds(
    segments: Sequence[Segment], moves: Moves, feeds_m_s: np.ndarray
) -> tuple[Segment, ...]:
    """Segments whose process segments are driven at feeds (m,) of their moves, in order."""
    made, number = [], 0
    for segment in segments:
        if segment.kind == "process":
            own = moves.segment == number
            number += 1
            if own.any():
                feeds, lengths = feeds_m_s[own], moves.lengths_m[own]
                mean = float(lengths.sum() / (lengths / feeds).sum()) if lengths.sum() else feeds[0]
                each = np.concatenate([feeds[:1], feeds])
                segment = replace(segment, feed_m_s=float(mean), feeds_m_s=each)
        made.append(segment)
    return tuple(made)
