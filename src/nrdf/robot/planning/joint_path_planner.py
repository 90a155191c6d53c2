"""Joint paths that cover the process segments of a tool path, without a jump of configuration.

From waypoints in the middle of each segment, reached in every configuration that is found and at
every turntable index, the arm tracks the segment to both sides as far as it can. The longest joint
paths are taken; where one ends, the tool lifts off and another begins. What is left over is tried
again with the tool axis tilted a little.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from nrdf.robot.model.cell import Cell
from nrdf.robot.planning.approach_retract import add_approach_retract
from nrdf.robot.planning.candidates import CandidatePaths, track_beyond, track_from
from nrdf.robot.planning.inverse_kinematics import SeedLibrary
from nrdf.robot.planning.joint_path import JointPath, densify
from nrdf.robot.planning.reachability import Reachability, solve_everywhere
from nrdf.toolpath.types import SegmentGroup

_ANCHORS_APART = 60
_ROUNDS, _TILTED_ROUNDS = 5, 2
_TURN = 6  # waypoints that a turn of the object must add, or save in lifts
_SHORTEST = 3  # waypoints of a joint path that is worth a lift, unless nothing longer is found


def plan_joint_paths(
    cell: Cell, library: SeedLibrary, groups: Sequence[SegmentGroup]
) -> tuple[list[JointPath], list[np.ndarray], list[Reachability]]:
    """Joint paths that cover the groups' process segments as far as the arm can.

    Also for each group which waypoints (n,) are covered, or need not be as a gun only runs up to
    its speed there, and the reachability of those that are not; it is only meaningful for those.
    """
    covered = [group.process.runs_up_at for group in groups]
    paths: list[JointPath] = []
    opened: set[int] = set()
    for round_ in range(_ROUNDS):
        anchors = _all_anchors(covered, round_)
        if not anchors:
            break
        fresh = track_from(cell, library, groups, covered, anchors, tilt=False)
        paths += _cover(cell, groups, fresh, covered, _SHORTEST if round_ < 2 else 1, opened)
    paths = _lengthened(cell, groups, paths, covered, opened)
    for round_ in range(_TILTED_ROUNDS):
        anchors = _all_anchors(covered, round_ + 2)
        if not anchors:
            break
        fresh = track_from(cell, library, groups, covered, anchors, tilt=True)
        paths += _cover(cell, groups, fresh, covered, 1, opened)
    reachability = []
    for group, done in zip(groups, covered, strict=True):
        made = Reachability(*(done.copy() for _ in range(3)))
        missing = np.flatnonzero(~done)
        if len(missing):
            process = group.process
            found = solve_everywhere(
                cell, library, process.positions[missing], process.axes[missing]
            )[1]
            for name in ("solved", "collision_free", "regular"):
                getattr(made, name)[missing] = getattr(found, name)
        reachability.append(made)
    return paths, covered, reachability


def _all_anchors(covered: Sequence[np.ndarray], round_: int) -> list[tuple[int, int]]:
    return [(i, k) for i, done in enumerate(covered) for k in _anchors(done, round_)]


def _anchors(done: np.ndarray, round_: int) -> list[int]:
    """The middle of each stretch that is not covered; of a long one, of each part."""
    missing = np.flatnonzero(~done)
    chosen = []
    for run in np.split(missing, np.flatnonzero(np.diff(missing) > 1) + 1):
        if len(run):
            parts = np.array_split(run, int(np.ceil(len(run) / (_ANCHORS_APART >> min(round_, 3)))))
            chosen += [int(part[len(part) // 2]) for part in parts]
    return chosen


def _lengthened(
    cell: Cell,
    groups: Sequence[SegmentGroup],
    paths: list[JointPath],
    covered: list[np.ndarray],
    opened: set[int],
) -> list[JointPath]:
    """Joint paths of segments that are not all covered, longer by what the tool reaches when its
    axis tilts."""
    whole = [bool(done.all()) for done in covered]
    again = [path for path in paths if not whole[path.group]]
    if not again:
        return paths
    candidates = track_beyond(cell, groups, again, covered)
    for path in again:
        covered[path.group] = groups[path.group].process.runs_up_at
    kept = [path for path in paths if whole[path.group]]
    return kept + _cover(cell, groups, candidates, covered, 1, opened)


def _cover(
    cell: Cell,
    groups: Sequence[SegmentGroup],
    candidates: CandidatePaths,
    covered: list[np.ndarray],
    least: int,
    opened: set[int],
) -> list[JointPath]:
    """As few joint paths as cover most; those whose approach or retract is blocked are left out.

    least: waypoints that a joint path must add. opened: turntable indices in use, which grow.
    """
    paths: list[JointPath] = []
    dropped = np.zeros(len(candidates.group), bool)
    while True:
        runs = {
            int(i): [
                (int(t), *run)
                for t in np.flatnonzero(~dropped & (candidates.group == i))
                for run in _runs(candidates, int(t), covered[i])
            ]
            for i in np.unique(candidates.group[~dropped])
        }
        chosen = _on_few_turns(candidates, runs, covered, least, opened)
        if not chosen:
            return paths
        longer = [_with_seam(groups, candidates, covered, chosen, *part) for part in chosen]
        for (row, first, last), path in zip(
            longer, _complete(cell, groups, candidates, longer), strict=True
        ):
            if path is not None:
                paths.append(path)
                covered[path.group][first : last + 1] = True
                opened.add(path.turntable_index)
            elif not candidates.blocked[row, first:last].any():
                dropped[row] = True


def _with_seam(
    groups: Sequence[SegmentGroup],
    candidates: CandidatePaths,
    covered: Sequence[np.ndarray],
    chosen: Sequence[tuple[int, int, int]],
    row: int,
    first: int,
    last: int,
) -> tuple[int, int, int]:
    """A part (row, first, last) of a candidate with its gun's run-up, as far as the arm reaches it;
    inside a line the gun goes on where that of the joint path beside it goes off."""
    i = int(candidates.group[row])
    process = groups[i].process
    if not process.runs_up:
        return row, first, last
    good, blocked, done = candidates.good[row], candidates.blocked[row], covered[i]
    gun_off = process.runs_up_at
    ends = {stop for other, _, stop in chosen if candidates.group[other] == i}
    if first and not gun_off[first - 1] and (done[first - 1] or first - 1 in ends):
        first -= bool(good[first - 1] and not blocked[first - 1])
    while first and gun_off[first - 1] and good[first - 1] and not blocked[first - 1]:
        first -= 1
    if last + 1 < len(done) and not gun_off[last + 1] and done[last + 1]:
        last += bool(good[last + 1] and not blocked[last])
    while last + 1 < len(done) and gun_off[last + 1] and good[last + 1] and not blocked[last]:
        last += 1
    return row, first, last


def _on_few_turns(
    candidates: CandidatePaths,
    runs: Mapping[int, Sequence[tuple[int, int, int]]],
    covered: Sequence[np.ndarray],
    least: int,
    opened: Collection[int],
) -> list[tuple[int, int, int]]:
    """The best parts (row, first, last) of each group's runs, at as few turntable indices as pay.

    opened: indices that are used already. Another one is used where that saves `_TURN` waypoints:
    the one that saves most, time and again.
    """
    index = candidates.turntable_index

    def best(used: Collection[int]) -> tuple[float, list[tuple[int, int, int]]]:
        cost, chosen = 0.0, []
        for i, some in runs.items():
            priced = [(*run, float(least)) for run in some if index[run[0]] in used]
            parts = fewest_runs(priced, ~covered[i])
            done = ~covered[i]
            for _, first, last in parts:
                done[first : last + 1] = False
            cost += float(done.sum()) + least * len(parts)
            chosen += parts
        return cost, chosen

    used = set(opened)
    cost, chosen = best(used)
    while True:
        others = {int(index[row]) for some in runs.values() for row, *_ in some} - used
        found = [(*best({*used, other}), other) for other in sorted(others)]
        # The first one is no turn of the object: it stands some way anyhow.
        gain = _TURN if used else 0.5
        if not found or (least_cost := min(entry[0] for entry in found)) > cost - gain:
            return chosen
        cost, chosen, other = next(entry for entry in found if entry[0] == least_cost)
        used.add(other)


def _runs(candidates: CandidatePaths, row: int, covered: np.ndarray) -> list[tuple[int, int]]:
    """First and last waypoint of each stretch that a candidate tracks and that is not covered."""
    index = np.flatnonzero(candidates.good[row, : len(covered)] & ~covered)
    if not len(index):
        return []
    parted = np.flatnonzero((np.diff(index) > 1) | candidates.blocked[row, index[:-1]])
    return [(int(run[0]), int(run[-1])) for run in np.split(index, parted + 1)]


def fewest_runs(
    runs: Sequence[tuple[int, int, int, float]], wanted: np.ndarray
) -> list[tuple[int, int, int]]:
    """Parts (row, first, last) of runs (row, first, last, price) that cover wanted waypoints (n,)
    for the least sum of prices, where each wanted waypoint that is left out costs 1.

    No two overlap. Optimal, by dynamic programming: each run is used to its end, from wherever the
    one before it ended.
    """
    count = len(wanted)
    ending: dict[int, list[tuple[int, int, float]]] = {}
    for row, first, last, price in runs:
        ending.setdefault(last + 1, []).append((row, first, price))
    cost = np.zeros(count + 1)
    via: list[tuple[int, int] | None] = [None] * (count + 1)
    for end in range(1, count + 1):
        cost[end] = cost[end - 1] + float(wanted[end - 1])
        for row, first, price in ending.get(end, ()):
            # From where it costs least to have come, as late as that: no waypoint is driven twice.
            begin = end - 1 - int(cost[first:end][::-1].argmin())
            if cost[begin] + price < cost[end]:
                cost[end], via[end] = cost[begin] + price, (row, begin)
    chosen, end = [], count
    while end > 0:
        step = via[end]
        if step is None:
            end -= 1
        else:
            chosen.append((step[0], step[1], end - 1))
            end = step[1]
    return chosen[::-1]


def _complete(
    cell: Cell,
    groups: Sequence[SegmentGroup],
    candidates: CandidatePaths,
    chosen: Sequence[tuple[int, int, int]],
) -> list[JointPath | None]:
    """Parts of candidates as whole joint paths.

    None where something is in the way, which is noted as blocked, or where the tool cannot leave
    the surface.
    """
    found = densify(cell, groups, [candidates.joint_path(*part) for part in chosen])
    clear = []
    for k, ((row, first, last), (_, hit)) in enumerate(zip(chosen, found, strict=True)):
        candidates.blocked[row, first:last] |= hit
        if not hit.any():
            clear.append(k)
    made: list[JointPath | None] = [None] * len(chosen)
    whole = add_approach_retract(cell, groups, [found[k][0] for k in clear])
    for k, path in zip(clear, whole, strict=True):
        made[k] = path
    return made
