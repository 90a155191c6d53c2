"""The moves of a tool path that work on a surface, sampled: where the tool is, how it is held."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from nrdf.errors import ProcessError
from nrdf.geometry.frames import unit_vectors
from nrdf.geometry.polylines import step_lengths
from nrdf.toolpath.types import Segment


@dataclass(frozen=True)
class ToolSamples:
    """Samples of a tool's way. places: (k, 3) of the tool centre point, m; axes: (k, 3) tool z;
    along: (k, 3) tool x; weights: (k,), the length, m, or time, s, that each stands for; column:
    (k,), which move or stop that is of."""

    places: np.ndarray
    axes: np.ndarray
    along: np.ndarray
    weights: np.ndarray
    column: np.ndarray

    def select(self, chosen: np.ndarray) -> ToolSamples:
        """Those of a mask (k,); columns keep their numbers."""
        return ToolSamples(
            self.places[chosen], self.axes[chosen], self.along[chosen], self.weights[chosen],
            self.column[chosen],
        )  # fmt: skip


@dataclass(frozen=True)
class Moves:
    """All moves between neighbouring waypoints of process segments at which the tool is on, and
    stops at their ends.

    lengths_m, feeds_m_s: (m,). segment: (m,), which of the segments. turns_rad: (m,), by how far
    the way turns from a move to the next one of its segment; 0 for the last. pressed: (m,), false
    where a pad is beyond the edge, at either end of a move, and is only held there. samples: of the
    moves; stops: of dwells, one for each segment that has one; stops_pressed: as of moves.
    """

    lengths_m: np.ndarray
    feeds_m_s: np.ndarray
    segment: np.ndarray
    turns_rad: np.ndarray
    pressed: np.ndarray
    samples: ToolSamples
    stops: ToolSamples
    stops_pressed: np.ndarray

    @staticmethod
    def of(segments: Sequence[Segment], step_m: float) -> Moves:
        """Of the process segments among `segments`, in samples at most `step_m` apart.

        Raises ProcessError where there is none.
        """
        work = [segment for segment in segments if segment.kind == "process"]
        if not work:
            raise ProcessError("a tool path without a process segment works nothing")
        lengths, feeds, owner, turns, over, stops_over = [], [], [], [], [], []
        parts: list[ToolSamples] = []
        stops: list[ToolSamples] = []
        count = 0
        for number, whole in enumerate(work):
            segment = _applied(whole)
            step = step_lengths(segment.positions)
            lengths.append(step)
            feeds.append(segment.speeds_m_s[1:])
            owner.append(np.full(len(step), number))
            turns.append(_turns(segment.positions))
            there = segment.over_surface
            over.append(there[:-1] & there[1:])
            parts.append(_sampled(segment, step, step_m, count))
            count += len(step)
            if segment.dwell_s > 0.0:
                stops.append(_stop(segment, len(stops)))
                stops_over.append(bool(there[-1]))
        return Moves(
            np.concatenate(lengths), np.concatenate(feeds), np.concatenate(owner),
            np.concatenate(turns), np.concatenate(over), _together(parts), _together(stops),
            np.array(stops_over, bool),
        )  # fmt: skip

    @property
    def slowness(self) -> np.ndarray:
        """Seconds for each metre (m,): what film and depth are proportional to."""
        return 1.0 / self.feeds_m_s

    @property
    def seconds(self) -> float:
        """Time of all moves and stops."""
        return float((self.lengths_m / self.feeds_m_s).sum() + self.stops.weights.sum())


def _applied(segment: Segment) -> Segment:
    """A process segment without what is driven with the tool off, before and after it."""
    on = np.flatnonzero(segment.applies)
    if segment.tool_on is None or not len(on):
        return segment
    return replace(segment.part(slice(on[0], on[-1] + 1)), tool_on=None)


def _turns(positions: np.ndarray) -> np.ndarray:
    """Angle (n - 1,) from each step to the next."""
    ways = unit_vectors(np.diff(positions, axis=0))
    if not len(ways):
        return np.zeros(0)
    cosine = np.clip(np.einsum("na,na->n", ways[:-1], ways[1:]), -1.0, 1.0)
    return np.append(np.arccos(cosine), 0.0)


def _sampled(segment: Segment, steps: np.ndarray, step_m: float, first: int) -> ToolSamples:
    """Midpoints of even parts of each move."""
    pieces = np.maximum(np.ceil(steps / step_m - 1e-9).astype(int), 1)
    move = np.repeat(np.arange(len(steps)), pieces)
    before = np.repeat(np.cumsum(pieces) - pieces, pieces)
    share = ((np.arange(len(move)) - before + 0.5) / pieces[move])[:, None]
    frames = Rotation.from_quat(segment.quaternions_xyzw).as_matrix()

    def between(values: np.ndarray) -> np.ndarray:
        return np.asarray((1.0 - share) * values[move] + share * values[move + 1])

    axes = unit_vectors(between(frames[:, :, 2]))
    along = between(frames[:, :, 0])
    along = unit_vectors(along - np.einsum("ka,ka->k", along, axes)[:, None] * axes)
    weights = steps[move] / pieces[move]
    return ToolSamples(between(segment.positions), axes, along, weights, first + move)


def _stop(segment: Segment, number: int) -> ToolSamples:
    frame = Rotation.from_quat(segment.quaternions_xyzw[-1]).as_matrix()
    return ToolSamples(
        segment.positions[-1:], frame[None, :, 2], frame[None, :, 0],
        np.array([segment.dwell_s]), np.array([number]),
    )  # fmt: skip


def _together(parts: Sequence[ToolSamples]) -> ToolSamples:
    if not parts:
        none = np.zeros((0, 3))
        return ToolSamples(none, none, none, np.zeros(0), np.zeros(0, int))
    names = ("places", "axes", "along", "weights", "column")
    return ToolSamples(*(np.concatenate([getattr(p, name) for p in parts]) for name in names))
