"""Lines followed from places in their middle, as far as the arm can, without a jump."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nrdf.robot.model.cell import Cell
from nrdf.robot.planning.inverse_kinematics import (
    LEAST_CLEARANCE_M,
    LEAST_SINGULAR,
    Library,
    singular_values,
    solve,
)
from nrdf.robot.planning.joint_paths import Piece, Stroke
from nrdf.robot.planning.lines import Line
from nrdf.robot.planning.step import LEANS, advance, advance_leaning, leaned

GUESSES = 6
_KEPT, _KEPT_A_TURN = 6, 2


@dataclass(frozen=True)
class IKSolutions:
    """Roadmap to reach targets: joints (b, n), index of the target (b,), turn (b,), worth (b,)."""

    joints: np.ndarray
    target: np.ndarray
    turn: np.ndarray
    worth: np.ndarray


@dataclass(frozen=True)
class Reachability:
    """For targets (m,), whether the arm gets there at all, there without a collision, and there
    without a singularity besides, at any turn."""

    arrives: np.ndarray
    clear: np.ndarray
    regular: np.ndarray


def places(
    cell: Cell, library: Library, positions: np.ndarray, axes: np.ndarray, guesses: int = GUESSES
) -> tuple[IKSolutions, Reachability]:
    """Every way found to reach targets (m, 3), (m, 3) in the object's frame, over all turns."""
    turns, count = len(cell.poses), len(positions)
    turn = np.tile(np.arange(turns), count)
    at, along = cell.to_base(turn, positions.repeat(turns, axis=0), axes.repeat(turns, axis=0))
    joints = library.guesses(at, along, guesses).reshape(count * turns * guesses, -1)
    at, along = at.repeat(guesses, axis=0), along.repeat(guesses, axis=0)
    turn = turn.repeat(guesses)
    target = np.arange(count).repeat(turns * guesses)
    joints, good = solve(cell.chain, joints, at, along)
    found = Reachability(*(np.zeros(count, bool) for _ in range(3)))
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
    return IKSolutions(joints[regular], target[regular], turn[regular], worth[regular]), found


@dataclass
class Tracks:
    """Followed lines: joints (t, length, n), axes (t, length, 3) and good (t, length) at their
    waypoints; cut (t, length), where something is in the way to the next one; line (t,), turn
    (t,)."""

    line: np.ndarray
    turn: np.ndarray
    joints: np.ndarray
    axes: np.ndarray
    good: np.ndarray
    cut: np.ndarray

    @staticmethod
    def empty(line: np.ndarray, turn: np.ndarray, length: int, size: int) -> Tracks:
        shape = (len(line), length)
        return Tracks(
            line, turn, np.zeros((*shape, size)), np.zeros((*shape, 3)),
            np.zeros(shape, bool), np.zeros(shape, bool),
        )  # fmt: skip

    def piece(self, row: int, first: int, last: int) -> Piece:
        part = slice(first, last + 1)
        return Piece(
            int(self.line[row]), first, last, int(self.turn[row]),
            self.axes[row, part].copy(), self.joints[row, part].copy(),
        )  # fmt: skip


def tracks_from(
    cell: Cell,
    library: Library,
    lines: Sequence[Line],
    covered: Sequence[np.ndarray],
    anchors: Sequence[tuple[int, int]],
    lean: bool,
) -> Tracks:
    """Tracks from each anchor's best places to both ends of what is not covered around it.

    anchors: a line and a waypoint each. lean: the tool may lean where it must.
    """
    positions = np.array([lines[i].positions[k] for i, k in anchors])
    axes = np.array([lines[i].axes[k] for i, k in anchors])
    sides = 1
    if lean:
        slants = [leaned(axes, share * cell.tool.leans_rad) for share in LEANS]
        tried = np.concatenate([axes[:, None], *slants], axis=1)
        sides = tried.shape[1]
        positions, axes = positions.repeat(sides, axis=0), tried.reshape(-1, 3)
    found, _ = places(cell, library, positions, axes, 2 if lean else GUESSES)
    chosen = _best(found, sides)
    owner = found.target[chosen] // sides
    start = np.array([anchors[t][1] for t in owner], int)
    line = np.array([anchors[t][0] for t in owner], int)
    longest = max((len(lines[i].positions) for i in line), default=1)
    tracks = Tracks.empty(line, found.turn[chosen], longest, cell.chain.size)
    row = np.arange(len(line))
    tracks.joints[row, start], tracks.good[row, start] = found.joints[chosen], True
    tracks.axes[row, start] = axes[found.target[chosen]]
    for way in (1, -1):
        _track(cell, lines, tracks, start, covered, way, lean)
    return tracks


def tracks_of(
    cell: Cell, lines: Sequence[Line], strokes: Sequence[Stroke], covered: Sequence[np.ndarray]
) -> Tracks:
    """Strokes as tracks, each as it is and, at the end, each again with what the arm reaches
    beyond its ends when the tool leans."""
    line = np.array([s.line for s in strokes], int)
    turn = np.array([s.turn for s in strokes], int)
    longest = max((len(lines[i].positions) for i in line), default=1)
    count = len(strokes)
    tracks = Tracks.empty(np.tile(line, 2), np.tile(turn, 2), longest, cell.chain.size)
    for row, s in enumerate([*strokes, *strokes]):
        part = slice(s.first, s.last + 1)
        tracks.joints[row, part], tracks.axes[row, part] = s.joints, s.axes
        tracks.good[row, part] = True
    ends = np.array([[s.first, s.last] for s in strokes], int).reshape(-1, 2)
    grown = np.arange(count, 2 * count)
    for way, start in ((1, ends[:, 1]), (-1, ends[:, 0])):
        _track(cell, lines, tracks, start, covered, way, True, grown)
    return tracks


def _best(found: IKSolutions, sides: int) -> np.ndarray:
    """Indices of the most worthy places of each target, a few a turn, the like left out.

    sides: axes that each target was asked with, the planned one first, as targets of their own.
    """
    chosen: list[int] = []
    target, side = found.target // sides, found.target % sides
    order = np.lexsort((-found.worth, side > 0, target))
    kept: list[int] = []
    for k in order:
        if kept and target[kept[0]] != target[k]:
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
    tracks: Tracks,
    start: np.ndarray,
    covered: Sequence[np.ndarray],
    way: int,
    lean: bool,
    rows: np.ndarray | None = None,
) -> None:
    """Extend tracks (`rows` of them, or all) from `start` forwards (1) or backwards (-1), until
    they fail, or come to the line's end or to what is covered."""
    active = np.arange(len(start)) if rows is None else rows
    at = start.copy()
    joints = tracks.joints[active, at]
    before = joints.copy()
    while len(active):
        at = at + way
        inside = np.array(
            [
                0 <= k < len(covered[i]) and not covered[i][k]
                for i, k in zip(tracks.line[active], at, strict=True)
            ],
            bool,
        )
        active, at, joints, before = (x[inside] for x in (active, at, joints, before))
        if not len(active):
            break
        pairs = list(zip(tracks.line[active], at, strict=True))
        position = np.array([lines[i].positions[k] for i, k in pairs])
        axis = np.array([lines[i].axes[k] for i, k in pairs])
        turn = tracks.turn[active]
        if lean:
            moved, good, axis = advance_leaning(cell, turn, joints, before, position, axis)
        else:
            moved, good = advance(cell, turn, joints, before, position, axis)
        tracks.joints[active, at], tracks.axes[active, at] = moved, axis
        tracks.good[active, at] = good
        before, joints = joints[good], moved[good]
        active, at = active[good], at[good]
