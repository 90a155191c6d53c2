"""A tool path as lines for an arm: the waypoints on the surface, and the ways to and from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nrdf.geometry.polylines import resample, total_length
from nrdf.toolpath.types import Segment, ToolPath

_STEP_M = 0.012
_SHORT_M = 0.03  # of a lead, where a path has none or a line begins anew


@dataclass(frozen=True)
class Line:
    """One process segment in the object's frame.

    number: of the line in its path. positions, axes: (n, 3), m, and tool z. lead_in, lead_out:
    (k, 3) places from the approach's start to before the first waypoint, and from after the last
    one to the retract's end; the tool keeps its axis there. Feeds in m/s.
    """

    number: int
    positions: np.ndarray
    axes: np.ndarray
    lead_in: np.ndarray
    lead_out: np.ndarray
    feed_m_s: float
    lead_in_feed_m_s: float
    lead_out_feed_m_s: float
    force_n: float | None
    dwell_s: float

    def leads(self, first: int, last: int) -> tuple[np.ndarray, np.ndarray]:
        """The ways to and from a part of the line: its own ones at its ends, along the tool's axis
        where it begins or ends in between."""
        size = len(self.positions) - 1
        into = self.lead_in
        if first:
            into = self.straight_away(first, -self.axes[first])[::-1]
        out = self.lead_out
        if last < size:
            out = self.straight_away(last, -self.axes[last])
        return into, out

    def straight_away(self, index: int, direction: np.ndarray) -> np.ndarray:
        """Places (k, 3) away from a waypoint in a direction (3,), outwards."""
        far = np.arange(_SHORT_M, 0.5 * _STEP_M, -_STEP_M)[::-1]
        return np.asarray(self.positions[index] + far[:, None] * direction)


def lines_of(path: ToolPath) -> tuple[Line, ...]:
    """The lines of a tool path, in driving order."""
    segments = path.segments
    made = []
    for i, segment in enumerate(segments):
        if segment.kind != "process" or not len(segment.positions):
            continue
        before = segments[i - 1] if i and segments[i - 1].kind == "approach" else None
        after = segments[i + 1] if i + 1 < len(segments) else None
        after = after if after is not None and after.kind == "retract" else None
        axes = segment.axes
        first, last = segment.positions[0], segment.positions[-1]
        made.append(
            Line(
                number=segment.line,
                positions=segment.positions,
                axes=axes,
                lead_in=_lead(before, first, axes[0]),
                lead_out=_lead(after, last, axes[-1], backwards=True)[::-1],
                feed_m_s=segment.feed_m_s,
                lead_in_feed_m_s=segment.feed_m_s if before is None else before.feed_m_s,
                lead_out_feed_m_s=segment.feed_m_s if after is None else after.feed_m_s,
                force_n=segment.force_n,
                dwell_s=segment.dwell_s,
            )
        )
    return tuple(made)


def _lead(
    segment: Segment | None, end: np.ndarray, axis: np.ndarray, backwards: bool = False
) -> np.ndarray:
    """Places of a free move that ends on the surface at `end`, evenly, without the end itself."""
    if segment is None:
        way = np.stack([end - _SHORT_M * axis, end])
    else:
        way = segment.positions[::-1] if backwards else segment.positions
    if total_length(way) < 1e-6:
        return np.zeros((0, 3))
    return resample(way, _STEP_M)[:-1]
