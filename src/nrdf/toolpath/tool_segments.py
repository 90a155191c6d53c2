"""From paths on the surface to process segments: how the tool is held along them, and back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from nrdf.geometry.frames import angles_between, without_sign_jumps
from nrdf.geometry.polylines import step_lengths
from nrdf.surface.target_mesh import TargetMesh
from nrdf.toolpath.frames import surface_frames, tilt_rotation, travel_directions
from nrdf.toolpath.modifiers.approach_retract import FreeMove, approach_retract
from nrdf.toolpath.modifiers.offset import edge_offset
from nrdf.toolpath.modifiers.resample import kept_waypoints
from nrdf.toolpath.modifiers.smooth_orientation import LARGEST_TILT_RAD, turned_steadily
from nrdf.toolpath.modifiers.split import LEAST_STEP_M, cut, turns
from nrdf.toolpath.size_limits import check_passes
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.surface_path import SurfacePath
from nrdf.toolpath.types import Segment

_ON_SURFACE_M = 1e-3
_NEVER = 1e3  # rad: more than any limit
_SMOOTH = 0.5  # stepovers over which the travel is averaged, to either side


def tool_segments(
    contacts: Sequence[np.ndarray], normals: Sequence[np.ndarray], strategy: Strategy
) -> list[Segment]:
    """Process segments of a tool along lines on the surface, one a line.

    contacts: (n, 3) of each line, m; normals: (n, 3), outward. The tool is held as the strategy
    says (heading, lead, tilt, stand-off); its axis may turn as fast as that makes it.
    """
    paths = [SurfacePath(c, n) for c, n in zip(contacts, normals, strict=True)]
    return [
        _segment(number, path, _held(path, strategy), strategy) for number, path in enumerate(paths)
    ]


def steady_tool_segments(
    paths: Sequence[SurfacePath], strategy: Strategy
) -> tuple[list[Segment], list[np.ndarray]]:
    """Process segments whose axis, lead and tilt included, turns no faster than the strategy
    allows, and the normals (n, 3) of the surface under each.

    Where lead or tilt swing around with the travel, as at a zigzag's turns, the axis is turned
    steadily; a path is split where that would take it too far off.
    """
    segments: list[Segment] = []
    normals = []
    waiting = list(paths)[::-1]
    while waiting:
        path = waiting.pop()
        held = _held(path, strategy)
        axes = held.as_matrix()[:, :, 2]
        steps = np.maximum(step_lengths(path.contacts), LEAST_STEP_M)
        allowed = strategy.largest_turn_rad_m * steps
        found = turns(axes)
        if (found > allowed).any():
            steady = turned_steadily(axes, allowed)
            settled = (turns(steady) <= allowed).all()
            if not settled or angles_between(axes, steady).max() > LARGEST_TILT_RAD:
                sharpest = np.arange(len(found)) == np.argmax(found / allowed)
                waiting += cut(path, sharpest)[::-1]
                continue
            held = _turned(axes, steady) * held
        segments.append(_segment(len(segments), path, held, strategy))
        normals.append(path.normals)
    return segments, normals


def with_edges(lines: Sequence[Segment], strategy: Strategy, surface: TargetMesh) -> list[Segment]:
    """Process segments that say where they are off a surface: beyond its edges, or risen from it,
    by more than a faceted mesh would be from a smooth one."""
    marked = []
    for line in lines:
        away = surface.nearest(contact_points(line, strategy), -line.axes).distances
        over = away <= _ON_SURFACE_M
        marked.append(line if over.all() else replace(line, on_surface=over))
    return marked


def fewer_waypoints(
    lines: Sequence[Segment], normals: Sequence[np.ndarray], strategy: Strategy
) -> tuple[list[Segment], list[np.ndarray]]:
    """Process segments, and the normals (n, 3) under each, without waypoints between which the way
    is straight and the tool does not turn: as the strategy's chord error, resample_turn_rad and
    resample_step_m have it."""
    thin, under = [], []
    for line, outward in zip(lines, normals, strict=True):
        held = Rotation.from_quat(line.quaternions_xyzw)
        turns_at = (held[:-1].inv() * held[1:]).magnitude()
        # An edge that the tool runs off is no straight way.
        turns_at = turns_at + _NEVER * (np.diff(line.over_surface.astype(int)) != 0)
        turned = np.append(0.0, np.cumsum(turns_at))
        kept = kept_waypoints(
            contact_points(line, strategy), turned, strategy.chord_error_m,
            strategy.resample_turn_rad, strategy.resample_step_m,
        )  # fmt: skip
        thin.append(
            replace(
                line,
                positions=line.positions[kept],
                quaternions_xyzw=line.quaternions_xyzw[kept],
                on_surface=None if line.on_surface is None else line.on_surface[kept],
            )
        )
        under.append(outward[kept])
    return thin, under


def add_approach_retract(
    lines: Sequence[Segment], normals: Sequence[np.ndarray], strategy: Strategy
) -> tuple[Segment, ...]:
    """Process segments in the given order, each with its approach and retract, for all passes.

    lines: process segments; their force and dwell become the strategy's. normals: (n, 3), outward,
    of the surface under the waypoints of each. Every second pass goes backwards; where the tool's
    heading follows the travel, it is then turned half around the normal. Raises ProcessError for
    too many of them.
    """
    check_passes(sum(len(line.positions) for line in lines), len(lines), strategy.passes)
    driven: list[Segment] = []
    under = []
    for index in range(strategy.passes):
        for k in range(len(lines)) if index % 2 == 0 else range(len(lines) - 1, -1, -1):
            line, outward = lines[k], normals[k]
            if index % 2:
                line, outward = _backwards(line, outward, strategy), outward[::-1]
            driven.append(
                Segment(
                    "process", len(driven), line.positions, line.quaternions_xyzw, line.feed_m_s,
                    strategy.force_n, strategy.dwell_s, line.feeds_m_s, line.on_surface,
                )
            )  # fmt: skip
            under.append(outward)
    approach = FreeMove(
        strategy.approach_distance_m,
        strategy.approach_angle_rad,
        strategy.approach_feed_m_s,
        strategy.lead_in_radius_m,
    )
    retract = FreeMove(
        strategy.retract_distance_m,
        strategy.retract_angle_rad,
        strategy.retract_feed_m_s,
        strategy.lead_out_radius_m,
    )
    return tuple(approach_retract(driven, under, approach, retract, strategy.spacing_m))


def contact_points(segment: Segment, strategy: Strategy) -> np.ndarray:
    """Where a segment's tool touches or points at the surface, (n, 3), m.

    What the strategy's stand-off, offset, drag and edge contact add to contacts is taken off.
    """
    held = Rotation.from_quat(segment.quaternions_xyzw)
    turned = held.as_matrix()
    upright = (held * tilt_rotation(strategy.lead_rad, strategy.tilt_rad).inv()).as_matrix()
    edge = edge_offset(strategy.edge_contact_m, strategy.lead_rad, strategy.tilt_rad)
    return np.asarray(
        segment.positions
        + strategy.standoff_m * turned[:, :, 2]
        + strategy.offset_m * upright[:, :, 2]
        - strategy.drag_m * upright[:, :, 0]
        - held.apply(edge)
    )


def _backwards(line: Segment, normals: np.ndarray, strategy: Strategy) -> Segment:
    """A segment driven from its end."""
    quaternions = line.quaternions_xyzw[::-1]
    if strategy.heading == "travel":
        half = Rotation.from_rotvec(np.pi * normals[::-1])
        quaternions = without_sign_jumps((half * Rotation.from_quat(quaternions)).as_quat())
    feeds, over, on = line.feeds_m_s, line.on_surface, line.tool_on
    return replace(
        line,
        positions=line.positions[::-1],
        quaternions_xyzw=quaternions,
        # A feed is that of the way to its waypoint.
        feeds_m_s=None if feeds is None else np.append(feeds[-1:], feeds[:0:-1]),
        on_surface=None if over is None else over[::-1],
        tool_on=None if on is None else on[::-1],
    )


def _held(path: SurfacePath, strategy: Strategy) -> Rotation:
    """The orientations (n) of a tool along a path."""
    if strategy.heading == "fixed":
        travel = np.tile(_fixed_heading(path, strategy), (len(path.contacts), 1))
    else:
        travel = travel_directions(path.contacts, _SMOOTH * strategy.stepover_m)
    upright = Rotation.from_matrix(surface_frames(travel, path.normals))
    return upright * tilt_rotation(strategy.lead_rad, strategy.tilt_rad)


def _fixed_heading(path: SurfacePath, strategy: Strategy) -> np.ndarray:
    """The direction (3,) that tool x keeps to: the lines', or the path's longest extent."""
    if strategy.direction is not None:
        return np.asarray(strategy.direction, dtype=np.float64)
    away = path.contacts - path.contacts.mean(axis=0)
    along = np.linalg.svd(away, full_matrices=False)[2][0]
    return np.asarray(along if along[np.argmax(np.abs(along))] > 0.0 else -along)


def _turned(axes: np.ndarray, wanted: np.ndarray) -> Rotation:
    """The smallest rotations (n) that take unit axes (n, 3) to wanted ones (n, 3)."""
    across = np.cross(axes, wanted)
    sine = np.linalg.norm(across, axis=1, keepdims=True)
    angle = angles_between(axes, wanted)[:, None]
    return Rotation.from_rotvec(
        np.where(sine > 1e-12, across / np.maximum(sine, 1e-12), 0.0) * angle
    )


def _segment(number: int, path: SurfacePath, held: Rotation, strategy: Strategy) -> Segment:
    places = path.contacts - strategy.standoff_m * held.as_matrix()[:, :, 2]
    quaternions = without_sign_jumps(held.as_quat())
    return Segment(
        "process", number, places, quaternions, strategy.feed_m_s, strategy.force_n,
        strategy.dwell_s,
    )  # fmt: skip
