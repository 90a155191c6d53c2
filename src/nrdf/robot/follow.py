"""Joint paths along the lines of a tool path, without a jump of configuration in any of them.

From places in the middle of each line, reached in as many ways as are found and at every turn of
the object, the arm follows the line to both sides as far as it can. The longest pieces make up the
line; where one ends, the tool lifts off and another begins.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from nrdf.robot.advance import advance, advance_along
from nrdf.robot.cell import Cell
from nrdf.robot.inverse import (
    LEAST_CLEARANCE_M,
    LEAST_SINGULAR,
    Library,
    singular_values,
    solve,
)
from nrdf.robot.lines import Line

GUESSES = 6
_KEPT, _KEPT_A_TURN = 6, 2
_ANCHORS_APART = 60
_ROUNDS = 7
_SHORTEST = 3  # waypoints of a piece that is worth a lift, unless nothing longer is found
_RETREAT_STEP_M, _RETREAT_STEPS = 0.012, 16
_LEAST_LEAD = 2  # steps that the tool must be able to leave the surface by


@dataclass(frozen=True)
class Stroke:
    """A line, or a piece of it, as the arm drives it at one turn of the object.

    line: index of it; first, last: of its waypoints, inclusive. joints: (m, n) at these; lead_in
    (k, n), lead_out (k, n): on the ways to and from.
    """

    line: int
    first: int
    last: int
    turn: int
    joints: np.ndarray
    lead_in: np.ndarray
    lead_out: np.ndarray

    def whole(self) -> np.ndarray:
        return np.concatenate([self.lead_in, self.joints, self.lead_out])


@dataclass(frozen=True)
class Places:
    """Ways to reach targets: joints (b, n), index of the target (b,), turn (b,), worth (b,)."""

    joints: np.ndarray
    target: np.ndarray
    turn: np.ndarray
    worth: np.ndarray


@dataclass(frozen=True)
class Why:
    """For targets (m,), whether the arm gets there at all, there without a collision, and there
    without a singularity besides, at any turn."""

    arrives: np.ndarray
    clear: np.ndarray
    regular: np.ndarray


def places(
    cell: Cell, library: Library, positions: np.ndarray, axes: np.ndarray, guesses: int = GUESSES
) -> tuple[Places, Why]:
    """Every way found to reach targets (m, 3), (m, 3) in the object's frame, over all turns."""
    turns, count = len(cell.poses), len(positions)
    turn = np.tile(np.arange(turns), count)
    at, along = cell.to_base(turn, positions.repeat(turns, axis=0), axes.repeat(turns, axis=0))
    joints = library.guesses(at, along, guesses).reshape(count * turns * guesses, -1)
    at, along = at.repeat(guesses, axis=0), along.repeat(guesses, axis=0)
    turn = turn.repeat(guesses)
    target = np.arange(count).repeat(turns * guesses)
    joints, good = solve(cell.chain, joints, at, along)
    found = Why(*(np.zeros(count, bool) for _ in range(3)))
    found.arrives[target[good]] = True
    joints, turn, target = joints[good], turn[good], target[good]
    frames = cell.chain.frames(joints)
    clearance = cell.clearance(frames, turn).least
    kept = np.flatnonzero(clearance > LEAST_CLEARANCE_M)
    kept = kept[cell.own_clearance(cell.chain.frames(joints[kept])) > LEAST_CLEARANCE_M]
    found.clear[target[kept]] = True
    joints, turn, target = joints[kept], turn[kept], target[kept]
    least = singular_values(cell.chain.frames(joints))
    regular = least > LEAST_SINGULAR
    found.regular[target[regular]] = True
    worth = np.minimum(clearance[kept], 0.04) / 0.04 + 0.5 * np.minimum(least / 0.12, 1.0)
    return Places(joints[regular], target[regular], turn[regular], worth[regular]), found


@dataclass
class _Tracks:
    """Followed lines: joints (t, length, n), good (t, length); line (t,), turn (t,)."""

    line: np.ndarray
    turn: np.ndarray
    joints: np.ndarray
    good: np.ndarray


def follow(
    cell: Cell, library: Library, lines: Sequence[Line]
) -> tuple[list[Stroke], list[np.ndarray], list[Why]]:
    """Strokes that cover the lines as far as the arm can, in driving order.

    Also for each line which waypoints (n,) are covered, and for those that are not, why; `Why` is
    of all of the line's waypoints, and only right where they are not covered.
    """
    covered = [np.zeros(len(line.positions), bool) for line in lines]
    strokes: list[Stroke] = []
    for round_ in range(_ROUNDS):
        anchors = [(i, k) for i, done in enumerate(covered) for k in _anchors(done, round_)]
        if not anchors:
            break
        fresh = _round(cell, library, lines, anchors)
        least = _SHORTEST if round_ < 2 else 1
        strokes += _cover(cell, lines, fresh, covered, least)
    why = []
    for line, done in zip(lines, covered, strict=True):
        told = Why(*(done.copy() for _ in range(3)))
        missing = np.flatnonzero(~done)
        if len(missing):
            found = places(cell, library, line.positions[missing], line.axes[missing])[1]
            for name in ("arrives", "clear", "regular"):
                getattr(told, name)[missing] = getattr(found, name)
        why.append(told)
    return _ordered(strokes), covered, why


def _anchors(done: np.ndarray, round_: int) -> list[int]:
    """The middle of each stretch that is not covered; of a long one, of each part."""
    missing = np.flatnonzero(~done)
    chosen = []
    for run in np.split(missing, np.flatnonzero(np.diff(missing) > 1) + 1):
        if len(run):
            parts = np.array_split(run, int(np.ceil(len(run) / (_ANCHORS_APART >> min(round_, 3)))))
            chosen += [int(part[len(part) // 2]) for part in parts]
    return chosen


def _round(
    cell: Cell, library: Library, lines: Sequence[Line], anchors: Sequence[tuple[int, int]]
) -> _Tracks:
    """Tracks from each anchor's best places to both ends of its line."""
    positions = np.array([lines[i].positions[k] for i, k in anchors])
    axes = np.array([lines[i].axes[k] for i, k in anchors])
    found, _ = places(cell, library, positions, axes)
    chosen = _best(found)
    start = np.array([anchors[t][1] for t in found.target[chosen]], int)
    line = np.array([anchors[t][0] for t in found.target[chosen]], int)
    turn, joints = found.turn[chosen], found.joints[chosen]
    sizes = np.array([len(lines[i].positions) for i in line], int)
    longest = int(sizes.max(initial=1))
    tracks = _Tracks(
        line, turn,
        np.zeros((len(line), longest, cell.chain.size)), np.zeros((len(line), longest), bool),
    )  # fmt: skip
    row = np.arange(len(line))
    tracks.joints[row, start], tracks.good[row, start] = joints, True
    for way in (1, -1):
        _track(cell, lines, tracks, start, sizes, way)
    return tracks


def _best(found: Places) -> np.ndarray:
    """Indices of the most worthy places of each target, a few a turn, the like left out."""
    chosen: list[int] = []
    order = np.lexsort((-found.worth, found.target))
    kept: list[int] = []
    for k in order:
        if kept and found.target[kept[0]] != found.target[k]:
            chosen, kept = chosen + kept, []
        if len(kept) >= _KEPT:
            continue
        same = [j for j in kept if found.turn[j] == found.turn[k]]
        alike = any(np.abs(found.joints[j] - found.joints[k]).max() < 0.3 for j in same)
        if len(same) < _KEPT_A_TURN and not alike:
            kept.append(int(k))
    return np.array(chosen + kept, int)


def _track(
    cell: Cell,
    lines: Sequence[Line],
    tracks: _Tracks,
    start: np.ndarray,
    sizes: np.ndarray,
    way: int,
) -> None:
    """Extend tracks from `start` (t,) forwards (1) or backwards (-1), until they fail or end."""
    active = np.arange(len(start))
    at = start.copy()
    joints = tracks.joints[active, at]
    before = joints.copy()
    while len(active):
        at = at + way
        inside = (at >= 0) & (at < sizes[active])
        active, at, joints, before = (x[inside] for x in (active, at, joints, before))
        if not len(active):
            break
        pairs = list(zip(tracks.line[active], at, strict=True))
        position = np.array([lines[i].positions[k] for i, k in pairs])
        axis = np.array([lines[i].axes[k] for i, k in pairs])
        moved, good = advance(cell, tracks.turn[active], joints, before, position, axis)
        tracks.joints[active, at], tracks.good[active, at] = moved, good
        before, joints = joints[good], moved[good]
        active, at = active[good], at[good]


def _cover(
    cell: Cell, lines: Sequence[Line], tracks: _Tracks, covered: list[np.ndarray], least: int
) -> list[Stroke]:
    """Strokes, longest first, each with its leads; those whose leads are blocked are left out."""
    strokes: list[Stroke] = []
    blocked = np.zeros(len(tracks.line), bool)
    popular = np.bincount(tracks.turn, tracks.good.sum(axis=1), len(cell.poses))
    rank = np.argsort(np.argsort(popular)) / len(popular)
    while True:
        best: dict[int, tuple[float, int, int, int]] = {}
        for t in np.flatnonzero(~blocked):
            i = int(tracks.line[t])
            todo = tracks.good[t, : len(covered[i])] & ~covered[i]
            index = np.flatnonzero(todo)
            if len(index) < least:
                continue
            runs = np.split(index, np.flatnonzero(np.diff(index) > 1) + 1)
            run = max(runs, key=len)
            # Of equally long ones, at the turn where most is done.
            score = len(run) + 0.9 * rank[tracks.turn[t]]
            if len(run) >= least and score > best.get(i, (0.0,))[0]:
                best[i] = (score, int(t), int(run[0]), int(run[-1]))
        if not best:
            return strokes
        for number, stroke in _with_leads(cell, lines, tracks, best).items():
            _, row, first, last = best[number]
            if stroke is None:
                blocked[row] = True
            else:
                strokes.append(stroke)
                covered[number][first : last + 1] = True


def _with_leads(
    cell: Cell, lines: Sequence[Line], tracks: _Tracks, best: dict[int, tuple[float, int, int, int]]
) -> dict[int, Stroke | None]:
    """By line, the stroke of a track's part with the ways to and from it; None where the tool
    cannot leave the surface."""
    turns, joints, ways, axes = [], [], [], []
    for i, (_, t, first, last) in best.items():
        into, out = lines[i].leads(first, last)
        turns += [tracks.turn[t]] * 2
        joints += [tracks.joints[t, first], tracks.joints[t, last]]
        ways += [into[::-1], out]
        axes += [lines[i].axes[first], lines[i].axes[last]]
    driven = advance_along(cell, np.array(turns), np.array(joints), ways, np.array(axes))
    made: dict[int, Stroke | None] = {}
    for number, (i, (_, t, first, last)) in enumerate(best.items()):
        into, out = driven[2 * number], driven[2 * number + 1]
        if min(len(into) - len(ways[2 * number]), len(out) - len(ways[2 * number + 1])) < 0 and (
            min(len(into), len(out)) < _LEAST_LEAD
        ):
            made[i] = None
            continue
        work = tracks.joints[t, first : last + 1].copy()
        made[i] = Stroke(i, first, last, int(tracks.turn[t]), work, into[::-1], out)
    return made


def retreat(cell: Cell, line: Line, stroke: Stroke, start: bool) -> Stroke:
    """A stroke whose way in (or out) begins (ends) farther from the surface, as far as is clear."""
    whole = stroke.whole()
    joints = whole[0] if start else whole[-1]
    axis = line.axes[stroke.first if start else stroke.last]
    turn = np.array([stroke.turn])
    pose = cell.poses[stroke.turn]
    tip = cell.chain.frames(joints[None]).tcp[0]
    tip = (tip - pose[:3, 3]) @ pose[:3, :3]
    way = tip - _RETREAT_STEP_M * np.arange(1, _RETREAT_STEPS + 1)[:, None] * axis
    driven = advance_along(cell, turn, joints[None], [way], axis[None])[0]
    if start:
        return replace(stroke, lead_in=np.concatenate([driven[::-1], stroke.lead_in]))
    return replace(stroke, lead_out=np.concatenate([stroke.lead_out, driven]))


def _ordered(strokes: list[Stroke]) -> list[Stroke]:
    """By turn, the one where most is done first; within it in the path's order."""
    done = np.bincount([s.turn for s in strokes], [len(s.joints) for s in strokes], minlength=1)
    return sorted(strokes, key=lambda s: (-done[s.turn], s.turn, s.line, s.first))
