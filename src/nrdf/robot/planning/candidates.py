"""Candidate joint paths: segments tracked from waypoints inside them, as far as the arm can."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nrdf.robot.model.cell import Cell
from nrdf.robot.planning.inverse_kinematics import SeedLibrary
from nrdf.robot.planning.joint_path import JointPath
from nrdf.robot.planning.path_tracking import TILT_SHARES, advance, advance_tilted, tilted_axes
from nrdf.robot.planning.reachability import SEEDS, IKSolutions, solve_everywhere
from nrdf.toolpath.types import SegmentGroup

_KEPT, _KEPT_PER_INDEX = 6, 2


@dataclass
class CandidatePaths:
    """Tracked segments.

    group (t,): index of each one's segment group; turntable_index (t,). joints (t, length, n), axes
    (t, length, 3) and good (t, length) at the segment's waypoints; blocked (t, length), where
    something is in the way to the next one.
    """

    group: np.ndarray
    turntable_index: np.ndarray
    joints: np.ndarray
    axes: np.ndarray
    good: np.ndarray
    blocked: np.ndarray

    @staticmethod
    def empty(
        group: np.ndarray, turntable_index: np.ndarray, length: int, size: int
    ) -> CandidatePaths:
        """Without any waypoint tracked, for `size` joints."""
        shape = (len(group), length)
        return CandidatePaths(
            group, turntable_index, np.zeros((*shape, size)), np.zeros((*shape, 3)),
            np.zeros(shape, bool), np.zeros(shape, bool),
        )  # fmt: skip

    def joint_path(self, row: int, first: int, last: int) -> JointPath:
        """A part of one candidate."""
        part = slice(first, last + 1)
        return JointPath(
            int(self.group[row]), first, last, int(self.turntable_index[row]),
            self.axes[row, part].copy(), self.joints[row, part].copy(),
        )  # fmt: skip


def track_from(
    cell: Cell,
    library: SeedLibrary,
    groups: Sequence[SegmentGroup],
    covered: Sequence[np.ndarray],
    anchors: Sequence[tuple[int, int]],
    tilt: bool,
) -> CandidatePaths:
    """Candidates from each anchor's best solutions to both ends of what is not covered around it.

    anchors: a group and a waypoint each. tilt: the tool axis may tilt where it must.
    """
    positions = np.array([groups[i].process.positions[k] for i, k in anchors])
    axes = np.array([groups[i].process.axes[k] for i, k in anchors])
    tries = 1
    if tilt:
        tilted = [tilted_axes(axes, share * cell.tool.max_tilt_rad) for share in TILT_SHARES]
        tried = np.concatenate([axes[:, None], *tilted], axis=1)
        tries = tried.shape[1]
        positions, axes = positions.repeat(tries, axis=0), tried.reshape(-1, 3)
    found, _ = solve_everywhere(cell, library, positions, axes, 2 if tilt else SEEDS)
    chosen = _best(found, tries)
    owner = found.target[chosen] // tries
    start = np.array([anchors[t][1] for t in owner], int)
    group = np.array([anchors[t][0] for t in owner], int)
    longest = max((len(groups[i].process.positions) for i in group), default=1)
    made = CandidatePaths.empty(group, found.turntable_index[chosen], longest, cell.chain.size)
    row = np.arange(len(group))
    made.joints[row, start], made.good[row, start] = found.joints[chosen], True
    made.axes[row, start] = axes[found.target[chosen]]
    for direction in (1, -1):
        _track(cell, groups, made, start, covered, direction, tilt)
    return made


def track_beyond(
    cell: Cell,
    groups: Sequence[SegmentGroup],
    paths: Sequence[JointPath],
    covered: Sequence[np.ndarray],
) -> CandidatePaths:
    """Joint paths as candidates, each as it is and then each again with what the arm reaches beyond
    its ends when the tool axis tilts."""
    group = np.array([path.group for path in paths], int)
    index = np.array([path.turntable_index for path in paths], int)
    longest = max((len(groups[i].process.positions) for i in group), default=1)
    count = len(paths)
    made = CandidatePaths.empty(np.tile(group, 2), np.tile(index, 2), longest, cell.chain.size)
    for row, path in enumerate([*paths, *paths]):
        part = slice(path.first, path.last + 1)
        made.joints[row, part], made.axes[row, part] = path.joints, path.axes
        made.good[row, part] = True
    ends = np.array([[path.first, path.last] for path in paths], int).reshape(-1, 2)
    grown = np.arange(count, 2 * count)
    for direction, start in ((1, ends[:, 1]), (-1, ends[:, 0])):
        _track(cell, groups, made, start, covered, direction, True, grown)
    return made


def _best(found: IKSolutions, tries: int) -> np.ndarray:
    """Indices of each target's best solutions, a few for each turntable index, without repeats.

    tries: axes that each target was solved with, the planned one first, as targets of their own.
    """
    chosen: list[int] = []
    target, tried = found.target // tries, found.target % tries
    order = np.lexsort((-found.score, tried > 0, target))
    kept: list[int] = []
    for k in order:
        if kept and target[kept[0]] != target[k]:
            chosen, kept = chosen + kept, []
        if len(kept) >= _KEPT:
            continue
        same = [j for j in kept if found.turntable_index[j] == found.turntable_index[k]]
        repeated = any(np.abs(found.joints[j] - found.joints[k]).max() < 0.3 for j in same)
        if len(same) < _KEPT_PER_INDEX and not repeated:
            kept.append(int(k))
    return np.array(chosen + kept, int)


def _track(
    cell: Cell,
    groups: Sequence[SegmentGroup],
    candidates: CandidatePaths,
    start: np.ndarray,
    covered: Sequence[np.ndarray],
    direction: int,
    tilt: bool,
    rows: np.ndarray | None = None,
) -> None:
    """Extend candidates (`rows` of them, or all) from `start` forwards (1) or backwards (-1), until
    they fail, or come to the segment's end or to what is covered: a gun's to its first waypoint."""
    active = np.arange(len(start)) if rows is None else rows
    at = start.copy()
    left = np.array([int(groups[i].process.runs_up) for i in candidates.group])
    joints = candidates.joints[active, at]
    before = joints.copy()
    while len(active):
        at = at + direction
        pairs = list(zip(candidates.group[active], at, strict=True))
        there = np.array([0 <= k < len(covered[i]) for i, k in pairs], bool)
        taken = np.array(
            [ok and covered[i][k] for ok, (i, k) in zip(there, pairs, strict=True)], bool
        )
        taken[there] &= ~np.array(
            [groups[i].process.runs_up_at[k] for i, k in np.array(pairs)[there]], bool
        )
        inside = there & (~taken | (left[active] > 0))
        left[active[taken]] -= 1
        active, at, joints, before = (x[inside] for x in (active, at, joints, before))
        if not len(active):
            break
        pairs = list(zip(candidates.group[active], at, strict=True))
        position = np.array([groups[i].process.positions[k] for i, k in pairs])
        axis = np.array([groups[i].process.axes[k] for i, k in pairs])
        index = candidates.turntable_index[active]
        if tilt:
            moved, good, axis = advance_tilted(cell, index, joints, before, position, axis)
        else:
            moved, good = advance(cell, index, joints, before, position, axis)
        candidates.joints[active, at], candidates.axes[active, at] = moved, axis
        candidates.good[active, at] = good
        before, joints = joints[good], moved[good]
        active, at = active[good], at[good]
