"""How long an arm takes for a tool path, estimated before any arm is planned.

Strokes at their feed, slower where the tool's axis turns; approaches, retracts and free moves;
turns of the object. The arm must lift off and come again wherever its tool meets the object: so
the tool is moved along the strokes, its shaft to any side that is free and towards the arm, as far
as one side leads. How long lifts, turns of the object and of the axis take was found on one job
(the demonstration's armchair); `nrdf eval arm` compares with the simulation on others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nrdf.geometry.frames import angles_between, perpendicular, tangent_frames
from nrdf.geometry.polylines import arc_length, step_lengths, total_length
from nrdf.surface.target_mesh import TargetMesh
from nrdf.toolpath.types import Segment, SegmentGroup, group_segments

_STEP_M = 0.03  # between places at which the tool is tried
_NECK_SHARE, _THINNEST, _SHAFT_SHARE = 0.4, 0.005, 1.5  # radii: of the tool's, and of the neck's
_NECK_M, _BEND_RAD = 0.1, np.radians(60.0)
_ALONG_NECK_M, _SPARE_M = (0.027, 0.05, 0.08), 0.004
_ALONG_SHAFT_M = ((0.0, None), (0.06, None), (0.15, 0.045), (0.25, 0.06), (0.4, 0.06))
"""Places along the shaft, from the bend, and the radius that must be free: that of the arm, later.
"""
_SIDES, _ANGLES = 8, 12  # that the shaft may point to; that the object may be turned to
_NEAR = float(np.cos(0.8))  # least cosine between shafts that turn into each other: neighbours
_TOWARDS_ARM = -0.25  # least cosine between the shaft and the way to the arm


@dataclass(frozen=True)
class ArmTimes:
    """What an arm takes. turn_rad_s: speed at which the tool's axis turns. transition_s: of a free
    move from one stroke to the next. turntable_s: of a turn of the object. lifts_per_m: more than
    the tool's own shape asks for, at ends of the arm's reach and of its joints."""

    turn_rad_s: float = 0.54
    transition_s: float = 3.9
    turntable_s: float = 3.3
    lifts_per_m: float = 0.4


@dataclass(frozen=True)
class CycleTime:
    """Seconds of a tool path: on the surface with dwells; approaches and retracts; free moves
    between strokes; turns of the object. strokes: between lifts, as many as are expected.
    reachable: share of the way on the surface where the tool meets nothing."""

    process_s: float
    approach_retract_s: float
    transition_s: float
    turntable_s: float
    strokes: float
    reachable: float

    @property
    def total_s(self) -> float:
        """Of all of it."""
        return self.process_s + self.approach_retract_s + self.transition_s + self.turntable_s


def estimate_cycle_time(
    segments: Sequence[Segment],
    surface: TargetMesh,
    tool_radius_m: float,
    up: np.ndarray,
    times: ArmTimes | None = None,
) -> CycleTime:
    """How long an arm takes for segments on an object that stands on a turntable before it.

    surface: the object's mesh, in the segments' frame; up: (3,) its upright axis there.
    """
    times = times or ArmTimes()
    process = free_s = strokes = length = worked = 0.0
    angles: set[int] = set()
    groups = group_segments(segments)
    picked = [_tried(group.process.positions) for group in groups]
    chosen = list(zip(groups, picked, strict=True))
    places = [np.zeros((0, 3)), *(g.process.positions[some] for g, some in chosen)]
    axes = [np.zeros((0, 3)), *(g.process.axes[some] for g, some in chosen)]
    # All at once: a question costs little more for many places than for one.
    sides = free_sides(surface, np.concatenate(places), np.concatenate(axes), tool_radius_m)
    cuts = np.cumsum([len(some) for some in picked])[:-1]
    for group, free, shafts in zip(groups, *(np.split(of, cuts) for of in sides), strict=False):
        work = group.process
        along = arc_length(work.positions)
        stretches, share, turned = _stretches(free, shafts, up)
        angles |= turned
        lifts = stretches + times.lifts_per_m * along[-1] * share
        strokes += lifts
        free_s += lifts * _free_seconds(group)
        process += share * _seconds(work, times.turn_rad_s) + lifts * work.dwell_s
        length, worked = length + along[-1], worked + share * along[-1]
    turns = max(len(angles), 1)
    return CycleTime(
        process_s=process,
        approach_retract_s=free_s,
        transition_s=times.transition_s * (strokes + turns),
        turntable_s=times.turntable_s * (turns - 1),
        strokes=strokes,
        reachable=worked / length if length else 1.0,
    )


def _tried(positions: np.ndarray) -> np.ndarray:
    """Which of positions (n, 3) the tool is tried at: (k,), ascending."""
    along = arc_length(positions)
    picked = np.searchsorted(along, np.arange(0.0, along[-1] + 1e-9, _STEP_M))
    return np.unique(np.minimum(picked, len(along) - 1))


def free_sides(
    surface: TargetMesh, positions: np.ndarray, axes: np.ndarray, radius: float
) -> tuple[np.ndarray, np.ndarray]:
    """Whether (m, sides) a tool at positions (m, 3), axes (m, 3) meets nothing with its shaft to
    each side, and the shaft's directions (m, sides, 3)."""
    out = -axes
    frames = tangent_frames(out)
    neck = max(_NECK_SHARE * radius, _THINNEST)
    clear: np.ndarray = np.ones(len(positions), bool)
    for height in _ALONG_NECK_M:
        clear &= surface.nearest(positions + height * out).distances > neck + _SPARE_M
    free = np.zeros((len(positions), _SIDES), bool)
    shafts = np.zeros((len(positions), _SIDES, 3))
    for side in range(_SIDES):
        angle = 2.0 * np.pi * side / _SIDES
        aside = np.cos(angle) * frames[:, 0] + np.sin(angle) * frames[:, 1]
        shafts[:, side] = np.cos(_BEND_RAD) * out + np.sin(_BEND_RAD) * aside
        left = np.flatnonzero(clear)
        for away, wide in _ALONG_SHAFT_M:
            places = positions[left] + _NECK_M * out[left] + away * shafts[left, side]
            enough = _SHAFT_SHARE * neck + _SPARE_M if wide is None else wide
            left = left[surface.nearest(places).distances > enough]
        free[left, side] = True
    return free, shafts


def _stretches(free: np.ndarray, shafts: np.ndarray, up: np.ndarray) -> tuple[int, float, set[int]]:
    """As few stretches as cover what is free (m, sides), each at one angle of the object and with
    its shaft turning from side to neighbouring side; their number, the share of places that they
    cover, and the angles."""
    one = perpendicular(np.asarray(up, float)[None])[0]
    other = np.cross(up, one)
    angle = 2.0 * np.pi * np.arange(_ANGLES) / _ANGLES
    arms = np.cos(angle)[:, None] * one + np.sin(angle)[:, None] * other
    there = free[:, None] & (np.einsum("msa,pa->mps", shafts, arms) > _TOWARDS_ARM)
    count, covered = 0, 0
    used: set[int] = set()
    state = np.zeros(there.shape[1:], bool)
    for now, possible in enumerate(there):
        following = state
        if state.any():  # frames may turn from place to place: directions tell which sides are near
            near = np.einsum("sa,ta->st", shafts[now - 1], shafts[now]) > _NEAR
            following = ((state.astype(np.int64) @ near.astype(np.int64)) > 0) & possible
            if not following.any():
                used.add(int(np.flatnonzero(state.any(axis=1))[0]))
        if not following.any() and possible.any():
            count, following = count + 1, possible
        state = following
        covered += bool(state.any())
    if state.any():
        used.add(int(np.flatnonzero(state.any(axis=1))[0]))
    return count, covered / max(len(there), 1), used


def _seconds(work: Segment, turn_rad_s: float) -> float:
    """Of a segment at its feed, slower where the tool's axis turns faster than the arm can."""
    if len(work.positions) < 2:
        return 0.0
    turned = angles_between(work.axes[:-1], work.axes[1:]) / turn_rad_s
    return float(np.maximum(step_lengths(work.positions) / work.speeds_m_s[1:], turned).sum())


def _free_seconds(group: SegmentGroup) -> float:
    """Of a group's approach and retract."""
    free = (s for s in (group.approach, group.retract) if s is not None)
    return sum(total_length(s.positions) / s.feed_m_s for s in free)
