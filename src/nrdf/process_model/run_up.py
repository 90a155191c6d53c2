"""Run-up: a line begins and ends at rest beside its region, with the gun off, and passes its ends
at speed.

An arm that begins a line at rest with the gun on leaves far too much there. So the line goes on
straight beyond its ends by v²/a, as far as the gun has the room for that. Where it has less, an arm
is slow there, and its gun has to wait (`nrdf.robot.planning.slow_ends`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from nrdf.geometry.frames import unit_vectors
from nrdf.surface.target_mesh import TargetMesh
from nrdf.toolpath.types import Segment

_LONGEST_M, _EVERY_M = 0.15, 0.01
_SPARE = 2.0  # times v²/2a: an arm at rest cannot turn all of its joints at that acceleration
_CLEAR = 0.6  # of the stand-off, that a gun keeps from the object


def rooms_for(
    segments: Sequence[Segment], target: TargetMesh, standoff_m: float, spacing_m: float = _EVERY_M
) -> np.ndarray:
    """How far (s, 2), m, each process segment can go on straight before its start and after its
    end, until the tool comes nearer to the object than a part of its stand-off."""
    work = [segment for segment in segments if segment.kind == "process"]
    steps = spacing_m * (1.0 + np.arange(round(_LONGEST_M / spacing_m)))
    ends, away = _ends(work)
    places = ends[:, None] + steps[:, None] * away[:, None]
    near = target.nearest(places.reshape(-1, 3)).distances.reshape(len(ends), -1)
    free = near > _CLEAR * standoff_m
    count = np.where(free.all(axis=1), free.shape[1], np.argmin(free, axis=1))
    return np.asarray((spacing_m * count).reshape(-1, 2))


def _ends(work: Sequence[Segment]) -> tuple[np.ndarray, np.ndarray]:
    """Places (2 s, 3) of segments' starts and ends in turn, and ways (2 s, 3) away from them."""
    ends, away = [], []
    for segment in work:
        places = segment.positions
        if len(places) < 2:
            places = np.repeat(places, 2, axis=0)
        ends += [places[0], places[-1]]
        away += [places[0] - places[1], places[-1] - places[-2]]
    return np.array(ends), unit_vectors(np.array(away))


def with_run_up(
    segments: Sequence[Segment], rooms_m: np.ndarray, acceleration_m_s2: float
) -> tuple[Segment, ...]:
    """Segments whose process segments begin and end as far outside as their speed there asks for,
    within their rooms (s, 2), m, with the tool off. Approaches and retracts go with them."""
    made = list(segments)
    number = 0
    for k, segment in enumerate(segments):
        if segment.kind != "process":
            continue
        room = rooms_m[number]
        number += 1
        if len(segment.positions) < 2:
            continue
        ends, away = _ends([segment])
        speeds = segment.speeds_m_s[[1, -1]]
        lengths = np.minimum(_SPARE * speeds**2 / (2.0 * acceleration_m_s2), room)
        counts = np.ceil(lengths / _EVERY_M - 1e-9).astype(int)
        ways = [
            ends[side] + away[side] * (lengths[side] * np.arange(1, n + 1) / max(n, 1))[:, None]
            for side, n in enumerate(counts)
        ]
        made[k] = _lengthened(segment, ways[0][::-1], ways[1], speeds)
        for beside, kind, side in ((k - 1, "approach", 0), (k + 1, "retract", 1)):
            if 0 <= beside < len(made) and made[beside].kind == kind:
                other = made[beside]
                shifted = other.positions + lengths[side] * away[side]
                made[beside] = replace(other, positions=shifted)
    return tuple(made)


def _lengthened(
    segment: Segment, before: np.ndarray, after: np.ndarray, speeds: np.ndarray
) -> Segment:
    """A process segment with waypoints (b, 3) before it and (a, 3) after it, where the tool is
    off."""
    sizes = (len(before), len(after))

    def padded(values: np.ndarray, *ends: object) -> np.ndarray:
        first, last = ends or (values[0], values[-1])
        return np.concatenate(
            [np.array([first] * sizes[0], values.dtype).reshape(-1, *values.shape[1:]), values,
             np.array([last] * sizes[1], values.dtype).reshape(-1, *values.shape[1:])]
        )  # fmt: skip

    return replace(
        segment,
        positions=np.concatenate([before, segment.positions, after]),
        quaternions_xyzw=padded(segment.quaternions_xyzw),
        feeds_m_s=padded(segment.speeds_m_s, *speeds),
        on_surface=padded(segment.over_surface, False, False),
        tool_on=padded(segment.applies, False, False),
    )
