"""Puts the contacts of tool paths onto the triangles of the target's own mesh.

Warped waypoints lie on a smooth surface that is fitted to at most some ten thousand points. On a
thin leg that surface is millimetres off the mesh.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from nrdf.surface.target_mesh import TargetMesh
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.types import Segment

AnySegment = TypeVar("AnySegment", bound=Segment)


def on_mesh(
    segments: Sequence[AnySegment], mesh: TargetMesh, strategy: Strategy
) -> tuple[AnySegment, ...]:
    """`project_to_mesh` by a process's settings.

    A contact that lies more than the tool's diameter from the mesh is not moved.
    """
    return project_to_mesh(segments, mesh, strategy.standoff_m, 2.0 * strategy.tool_radius_m)


def project_to_mesh(
    segments: Sequence[AnySegment], mesh: TargetMesh, standoff_m: float, reach_m: float
) -> tuple[AnySegment, ...]:
    """The segments, with every contact of a process segment on the nearest triangle of its side.

    A contact lies `standoff_m` before the tool centre point, along the tool's axis. It stays where
    it is if it would move by more than `reach_m`: there the mesh has no surface of that side. The
    tool keeps its axis. Approach and retract move along with the end that they belong to.
    """
    moves = [
        _moves(s, mesh, standoff_m, reach_m) if s.kind == "process" else None for s in segments
    ]
    made = []
    for number, (segment, move) in enumerate(zip(segments, moves, strict=True)):
        if move is None:
            end = _end_it_belongs_to(segment, moves, number)
            move = np.zeros(3) if end is None else end
        made.append(replace(segment, positions=segment.positions + move))
    return tuple(made)


def _moves(segment: Segment, mesh: TargetMesh, standoff_m: float, reach_m: float) -> np.ndarray:
    """How far (n, 3), m, each waypoint of a segment moves."""
    contacts = segment.positions + standoff_m * segment.axes
    nearest = mesh.nearest(contacts, -segment.axes)
    near = nearest.distances <= reach_m
    return np.where(near[:, None], nearest.points - contacts, 0.0)


def _end_it_belongs_to(
    segment: Segment, moves: Sequence[np.ndarray | None], number: int
) -> np.ndarray | None:
    """The move (3,) of the waypoint that an approach leads to, or a retract comes from."""
    if segment.kind == "approach" and number + 1 < len(moves):
        after = moves[number + 1]
        return None if after is None or not len(after) else after[0]
    if segment.kind == "retract" and number:
        before = moves[number - 1]
        return None if before is None or not len(before) else before[-1]
    return None
