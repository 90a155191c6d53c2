"""Waypoints warped from the reference to another object.

The point of the reference's surface under each waypoint goes through the correspondence. The tool
keeps its height and its angles relative to the local frame of travel and normal.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from nrdf.geometry.polylines import step_lengths
from nrdf.process.correspondence import Correspondence
from nrdf.surface.surface import Surface
from nrdf.toolpath.frames import surface_frames, travel_directions
from nrdf.toolpath.types import Segment

_TORN, _GAP = 1.5, 1.2  # times its length on the reference, and spacings, that a step may have
_SMOOTH = 2.0  # spacings of points over which the direction of travel is averaged
_FACING = 0.1  # cosine above which a side faces a tool: the side round a square corner does not


@dataclass(frozen=True, kw_only=True)
class WarpedSegment(Segment):
    """A process segment on the target. line: the number of the given segment that it comes from.
    normals: (n, 3) of the surface under it; source: (n,) which of that segment's waypoints
    these are."""

    normals: np.ndarray
    source: np.ndarray


def warp_segments(
    correspondence: Correspondence, segments: Sequence[Segment], tool_radius_m: float
) -> tuple[tuple[WarpedSegment, ...], int]:
    """Process segments on the reference as segments on the target, and how many waypoints have no
    counterpart there.

    A segment is cut where waypoints have no counterpart, and where the surface is torn between two
    of them, so that no tool crosses a gap. The tool's height over the surface, and its angles to
    travel and normal, stay; normals are smoothed over a flat tool of `tool_radius_m`.
    """
    if not segments:
        return (), 0
    source = correspondence.reference.surface
    target = correspondence.target_surface
    positions = np.concatenate([segment.positions for segment in segments])
    quaternions = np.concatenate([segment.quaternions_xyzw for segment in segments])
    owner = np.repeat(np.arange(len(segments)), [len(s.positions) for s in segments])
    rotations = Rotation.from_quat(quaternions).as_matrix()
    under, normals = surface_under(source, positions, -rotations[:, :, 2])
    smooth = source.smooth_normals(under, normals, tool_radius_m)
    found, found_normals, exists = correspondence.map_points(under, normals)
    found_smooth = target.smooth_normals(found, found_normals, tool_radius_m)
    # A waypoint alone has no travel: a short step along tool x is mapped instead.
    ahead, ahead_normals = source.project(under + 2 * source.spacing * rotations[:, :, 0], normals)
    step = correspondence.map_points(ahead, ahead_normals)[0] - found
    warped, lost = [], int((~exists).sum())
    for number, segment in enumerate(segments):
        own = np.flatnonzero(owner == number)
        step_there = step_lengths(found[own])
        step_here = step_lengths(under[own])
        torn = step_there > _TORN * correspondence.scale * step_here + _GAP * target.spacing
        for run in _runs(exists[own], torn):
            at = own[run]
            here = _frames(under[at], smooth[at], rotations[at, :, 0], source.spacing)
            there = _frames(found[at], found_smooth[at], step[at], target.spacing)
            change = there @ here.transpose(0, 2, 1)
            offset = np.einsum("mab,mb->ma", change, positions[at] - under[at])
            warped.append(
                WarpedSegment(
                    kind="process",
                    line=number,
                    positions=found[at] + offset,
                    quaternions_xyzw=Rotation.from_matrix(change @ rotations[at]).as_quat(),
                    feed_m_s=segment.feed_m_s,
                    force_n=segment.force_n,
                    dwell_s=segment.dwell_s,
                    normals=found_smooth[at],
                    source=run,
                )
            )
    return tuple(warped), lost


def surface_under(
    surface: Surface, positions: np.ndarray, axes: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The smooth surface under tools at positions (m, 3), and its normals there, each (m, 3).

    axes: (m, 3), from the tool's tip to its tail; the nearest surface that faces the tail counts,
    so that a tool near a thin part's edge stays on its side.
    """
    near = surface.tree.query(positions, np.arange(1, min(32, len(surface.points)) + 1))[1]
    facing = np.einsum("mka,ma->mk", surface.normals[near], axes) > _FACING
    # The first that faces the tool, or the nearest of all.
    first = near[np.arange(len(near)), facing.argmax(axis=1)]
    start, normals = surface.points[first], surface.normals[first]
    height = np.einsum("ma,ma->m", positions - start, normals)
    sideways = positions - start - height[:, None] * normals
    length = np.linalg.norm(sideways, axis=1, keepdims=True)
    sideways *= np.minimum(1.0, 2 * surface.spacing / np.maximum(length, 1e-12))
    return surface.project(start + sideways, normals)


def _frames(
    points: np.ndarray, normals: np.ndarray, alone: np.ndarray, spacing: float
) -> np.ndarray:
    """Frames (n, 3, 3) of travel and normal along a line; `alone` (n, 3) is the travel where the
    line does not move."""
    moves = len(points) > 1 and float(np.ptp(points, axis=0).max()) > 0.5 * spacing
    travel = travel_directions(points, _SMOOTH * spacing) if moves else alone
    return surface_frames(travel, normals)


def _runs(good: np.ndarray, torn: np.ndarray) -> list[np.ndarray]:
    """Indices of each stretch of True in `good` (n,) that `torn` (n - 1,) between two does not
    break."""
    places = np.flatnonzero(good)
    if not len(places):
        return []
    broken = (np.diff(places) > 1) | torn[places[:-1]]
    return np.split(places, np.flatnonzero(broken) + 1)
