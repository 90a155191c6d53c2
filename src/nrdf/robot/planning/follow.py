"""Joint paths along the lines of a tool path, without a jump of configuration in any of them.

From places in the middle of each line, reached in as many ways as are found and at every turn of
the object, the arm follows the line to both sides as far as it can. The longest pieces make up the
line; where one ends, the tool lifts off and another begins. What is left over is tried again with
the tool leaning a little.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nrdf.robot.model.cell import Cell
from nrdf.robot.planning.inverse_kinematics import Library
from nrdf.robot.planning.joint_paths import Stroke, add_approach_retract, between
from nrdf.robot.planning.lines import Line
from nrdf.robot.planning.tracks import Reachability, Tracks, places, tracks_from, tracks_of

_ANCHORS_APART = 60
_ROUNDS, _LEANING_ROUNDS = 5, 2
_SHORTEST = 3  # waypoints of a piece that is worth a lift, unless nothing longer is found


def follow(
    cell: Cell, library: Library, lines: Sequence[Line]
) -> tuple[list[Stroke], list[np.ndarray], list[Reachability]]:
    """Strokes that cover the lines as far as the arm can.

    Also for each line which waypoints (n,) are covered, and for those that are not, why;
    `Reachability` is of all of the line's waypoints, and only right where they are not covered.
    """
    covered = [np.zeros(len(line.positions), bool) for line in lines]
    strokes: list[Stroke] = []
    for round_ in range(_ROUNDS):
        anchors = _all_anchors(covered, round_)
        if not anchors:
            break
        fresh = tracks_from(cell, library, lines, covered, anchors, lean=False)
        strokes += _cover(cell, lines, fresh, covered, _SHORTEST if round_ < 2 else 1)
    strokes = _lengthened(cell, lines, strokes, covered)
    for round_ in range(_LEANING_ROUNDS):
        anchors = _all_anchors(covered, round_ + 2)
        if not anchors:
            break
        fresh = tracks_from(cell, library, lines, covered, anchors, lean=True)
        strokes += _cover(cell, lines, fresh, covered, 1)
    why = []
    for line, done in zip(lines, covered, strict=True):
        told = Reachability(*(done.copy() for _ in range(3)))
        missing = np.flatnonzero(~done)
        if len(missing):
            found = places(cell, library, line.positions[missing], line.axes[missing])[1]
            for name in ("arrives", "clear", "regular"):
                getattr(told, name)[missing] = getattr(found, name)
        why.append(told)
    return strokes, covered, why


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
    cell: Cell, lines: Sequence[Line], strokes: list[Stroke], covered: list[np.ndarray]
) -> list[Stroke]:
    """Strokes of lines that are not all covered, longer by what the tool reaches when it leans."""
    whole = [bool(done.all()) for done in covered]
    again = [s for s in strokes if not whole[s.line]]
    if not again:
        return strokes
    tracks = tracks_of(cell, lines, again, covered)
    for s in again:
        covered[s.line][:] = False
    kept = [s for s in strokes if whole[s.line]]
    return kept + _cover(cell, lines, tracks, covered, 1)


def _cover(
    cell: Cell, lines: Sequence[Line], tracks: Tracks, covered: list[np.ndarray], least: int
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
            parted = (np.diff(index) > 1) | tracks.cut[t, index[:-1]]
            run = max(np.split(index, np.flatnonzero(parted) + 1), key=len)
            # Of equally long ones, at the turn where most is done.
            score = len(run) + 0.9 * rank[tracks.turn[t]]
            if len(run) >= least and score > best.get(i, (0.0,))[0]:
                best[i] = (score, int(t), int(run[0]), int(run[-1]))
        if not best:
            return strokes
        chosen = [(row, first, last) for _, row, first, last in best.values()]
        for (row, first, last), stroke in zip(
            chosen, _tried(cell, lines, tracks, chosen), strict=True
        ):
            if stroke is not None:
                strokes.append(stroke)
                covered[stroke.line][first : last + 1] = True
            elif not tracks.cut[row, first:last].any():
                blocked[row] = True


def _tried(
    cell: Cell, lines: Sequence[Line], tracks: Tracks, chosen: Sequence[tuple[int, int, int]]
) -> list[Stroke | None]:
    """Strokes of parts of tracks; None where something is in the way, which is noted as a cut, or
    where the tool cannot leave the surface."""
    pieces = [tracks.piece(*part) for part in chosen]
    found = between(cell, lines, pieces)
    clear = []
    for k, ((row, first, last), (_, _, hit)) in enumerate(zip(chosen, found, strict=True)):
        tracks.cut[row, first:last] |= hit
        if not hit.any():
            clear.append(k)
    made: list[Stroke | None] = [None] * len(chosen)
    driven = add_approach_retract(
        cell, lines, [pieces[k] for k in clear], [found[k][:2] for k in clear]
    )
    for k, stroke in zip(clear, driven, strict=True):
        made[k] = stroke
    return made
