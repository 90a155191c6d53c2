"""What the arm does from beginning to end: strokes, and the free moves and turns between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from nrdf.geometry.polylines import step_lengths
from nrdf.robot.model.cell import Cell
from nrdf.robot.planning.inverse_kinematics import Library
from nrdf.robot.planning.joint_paths import Stroke, retreat
from nrdf.robot.planning.lines import Line
from nrdf.robot.planning.motion_planner import Roadmap
from nrdf.robot.planning.timing import FREE_SHARE, STEP_S, TimedTrajectory, time_parameterize

FREE_M_S = 1.5
"""How fast the tool may be in free moves."""
TURN_RAD_S = np.radians(45.0)
"""How fast the turntable turns."""
_MOST_WOUND = 3
_FARTHEST_RAD = 5.0  # of a joint from home
_HOME_CLEARANCE_M = 0.05
_MOST_HOMES, _HOME_TURNS = 400, 36

Kind = Literal["free", "approach", "process", "retract", "turn"]


@dataclass(frozen=True)
class Action:
    """One stretch of what the arm does.

    turn: which of the object's turns. timed: joints at each step, the arm at rest at both ends.
    line, first: of a stroke, which line of its path and the waypoint it begins at; -1 elsewhere.
    angles_rad: (t,) of the object at each step where it turns, none elsewhere.
    """

    kind: Kind
    turn: int
    timed: TimedTrajectory
    line: int = -1
    first: int = 0
    force_n: float | None = None
    dwell_s: float = 0.0
    angles_rad: np.ndarray = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True)
class PathProgram:
    """The actions of one tool path.

    strokes: those driven, without those that no free way leads to. given: the same as they were
    asked for, before joints were wound or ways to and from them made longer.
    """

    actions: tuple[Action, ...]
    strokes: tuple[Stroke, ...]
    given: tuple[Stroke, ...]


def find_home(cell: Cell, library: Library) -> np.ndarray:
    """Joints (n,) at which the object may turn: far from it at every turn, and near the middle."""
    chosen = library.joints[:_MOST_HOMES]
    least = np.full(len(chosen), np.inf)
    frames = cell.chain.frames(chosen)
    if len(cell.poses) > 1:
        cell = cell.turned(np.arange(_HOME_TURNS) * 2.0 * np.pi / _HOME_TURNS)
    for turn in range(len(cell.poses)):
        found = cell.clearance(frames, np.full(len(chosen), turn)).least
        least = np.minimum(least, found)
    stretch = np.abs(chosen).max(axis=1)
    worth = np.minimum(least, 0.15) - 0.02 * stretch
    worth[least < _HOME_CLEARANCE_M] = least[least < _HOME_CLEARANCE_M] - 1.0
    return np.asarray(chosen[int(worth.argmax())])


class Planner:
    """Plans programs for one tool path; what it has planned once it does not plan again."""

    def __init__(
        self,
        cell: Cell,
        lines: Sequence[Line],
        home: np.ndarray,
        library: Library,
        rng: np.random.Generator,
    ) -> None:
        self.cell, self.lines, self.home = cell, lines, home
        self._library, self._rng = library, rng
        self._ways: dict[int, Roadmap] = {}
        self._joined: dict[int, tuple[Stroke, Stroke, int | None, int | None]] = {}
        self._free: dict[tuple[int, int, int], Action] = {}
        self._strokes: dict[int, list[Action]] = {}
        self._turns: dict[tuple[int, int], Action] = {}

    def program(self, strokes: Sequence[Stroke], in_order: bool = False) -> PathProgram:
        """Drive strokes from home and back to it: turn by turn, and each time the nearest one next;
        or, with `in_order`, as they come."""
        actions: list[Action] = []
        driven, planned = [], []
        turn = -1
        node, at = 0, self.home
        waiting = list(strokes) if in_order else _ordered(strokes)
        while waiting:
            stroke = waiting[0]
            if not in_order:
                same = [s for s in waiting if s.turn == waiting[0].turn]
                stroke = min(same, key=lambda s: float(np.abs(s.whole()[0] - at).max()))
            waiting = [s for s in waiting if s is not stroke]
            joined, start, stop = self._join(stroke)
            if start is None or stop is None:
                continue
            if stroke.turn != turn:
                if turn >= 0 and node:
                    actions.append(self._freely(turn, node, 0))
                actions.append(self._turn(turn, stroke.turn))
                turn, node = stroke.turn, 0
            actions.append(self._freely(turn, node, start))
            if id(joined) not in self._strokes:
                line = self.lines[stroke.line]
                self._strokes[id(joined)] = _stroke(self.cell, line, joined)
            actions += self._strokes[id(joined)]
            driven.append(joined)
            planned.append(stroke)
            node, at = stop, joined.whole()[-1]
        if node:
            actions.append(self._freely(turn, node, 0))
        return PathProgram(tuple(actions), tuple(driven), tuple(planned))

    def _join(self, stroke: Stroke) -> tuple[Stroke, int | None, int | None]:
        if stroke.turn not in self._ways:
            self._ways[stroke.turn] = Roadmap(
                self.cell, self._library, stroke.turn, self.home, self._rng
            )
        # With the stroke itself: its number is taken by another when it is gone.
        if id(stroke) not in self._joined:
            found = _joined(self._ways[stroke.turn], self.cell, stroke, self.home)
            self._joined[id(stroke)] = (stroke, *found)
        return self._joined[id(stroke)][1:]

    def _freely(self, turn: int, one: int, other: int) -> Action:
        if (turn, one, other) not in self._free:
            way = self._ways[turn].way(one, other)
            self._free[turn, one, other] = _free(self.cell, turn, way)
        return self._free[turn, one, other]

    def _turn(self, before: int, after: int) -> Action:
        if (before, after) not in self._turns:
            self._turns[before, after] = _turned(self.cell, before, after, self.home)
        return self._turns[before, after]


def _ordered(strokes: Sequence[Stroke]) -> list[Stroke]:
    """By turn, the one where most is done first; within it in the path's order."""
    done = np.bincount([s.turn for s in strokes], [len(s.joints) for s in strokes], minlength=1)
    return sorted(strokes, key=lambda s: (-done[s.turn], s.turn, s.line, s.first))


def _joined(
    net: Roadmap, cell: Cell, stroke: Stroke, home: np.ndarray
) -> tuple[Stroke, int | None, int | None]:
    """A stroke, and the nodes of its start and end: with a joint a whole turn away, or farther off
    the surface, where that helps; None where nothing does."""
    wound = _wound(cell, stroke, home)
    for other in wound:
        start = net.link(other.whole()[0])
        stop = None if start is None else net.link(other.whole()[-1])
        if stop is not None:
            return other, start, stop
    for other in wound[:_MOST_WOUND]:
        ends: list[int | None] = []
        for begins in (True, False):
            index = 0 if begins else -1
            node = net.link(other.whole()[index])
            if node is None:
                other = retreat(cell, other, begins)
                node = net.link(other.whole()[index])
            ends.append(net.explore(other.whole()[index]) if node is None else node)
            if ends[-1] is None:
                break
        else:
            return other, ends[0], ends[1]
    return stroke, None, None


def _wound(cell: Cell, stroke: Stroke, home: np.ndarray) -> list[Stroke]:
    """The same stroke with none or one of its joints a whole turn away, those near home first.

    An arm's upper arm comes to the same place over its column's front or over its back, of which
    the one may be blocked all the way.
    """
    whole = stroke.whole()
    low, high = whole.min(axis=0), whole.max(axis=0)
    found = [(float(np.abs(whole[0] - home).max()), stroke)]
    for joint in np.flatnonzero(~cell.chain.slides):
        for turn in (-2.0 * np.pi, 2.0 * np.pi):
            if low[joint] + turn < cell.chain.lower[joint]:
                continue
            if high[joint] + turn > cell.chain.upper[joint]:
                continue
            shift = turn * np.eye(cell.chain.size)[joint]
            # As far off as the joint itself is, not as whichever is farthest.
            far = float(abs(whole[0, joint] + turn - home[joint]))
            found.append((far, stroke.wound(shift)))
    return [other for far, other in sorted(found, key=lambda pair: pair[0]) if far < _FARTHEST_RAD]


def _free(cell: Cell, turn: int, way: np.ndarray) -> Action:
    """A free move through corners, at each of which the arm stops."""
    parts = [
        time_parameterize(cell.chain, np.stack([a, b]), np.array([far / FREE_M_S]), FREE_SHARE)
        for a, b, far in zip(way[:-1], way[1:], _lengths(cell, way), strict=True)
    ]
    if not parts:
        parts = [time_parameterize(cell.chain, way[:1], np.zeros(0))]
    joined = TimedTrajectory(
        np.concatenate([part.joints for part in parts]),
        np.concatenate([part.speeds for part in parts]),
        np.concatenate([part.place + i for i, part in enumerate(parts)]),
        np.ones(len(way)),
    )
    return Action("free", turn, joined)


def _lengths(cell: Cell, way: np.ndarray) -> np.ndarray:
    """About how far (k - 1,), m, the tool goes between corners (k, n)."""
    fine = way[:-1, None] + np.linspace(0.0, 1.0, 6)[:, None] * np.diff(way, axis=0)[:, None]
    tips = cell.chain.frames(fine.reshape(-1, way.shape[1])).tcp.reshape(len(way) - 1, 6, 3)
    return np.asarray(np.linalg.norm(np.diff(tips, axis=1), axis=2).sum(axis=1))


def _turned(cell: Cell, before: int, after: int, home: np.ndarray) -> Action:
    """The object turns while the arm waits at home; no time for the first turn, set up by hand."""
    apart = 0.0
    if before >= 0:
        apart = cell.turns_rad[after] - cell.turns_rad[before]
        apart = (apart + np.pi) % (2.0 * np.pi) - np.pi  # the shorter way round
    count = max(int(np.ceil(abs(apart) / TURN_RAD_S / STEP_S)), 1)
    still = np.repeat(home[None], count, axis=0)
    timing = TimedTrajectory(still, 0.0 * still, np.zeros(count), np.ones(1))
    angles = cell.turns_rad[after] - apart * np.linspace(1.0, 0.0, count + 1)[1:]
    return Action("turn", after, timing, angles_rad=angles)


def _stroke(cell: Cell, line: Line, stroke: Stroke) -> list[Action]:
    made: list[Action] = []
    parts = (
        ("approach", [*stroke.lead_in, stroke.joints[0]], line.lead_in_feed_m_s),
        ("process", [*stroke.joints], line.feed_m_s),
        ("retract", [stroke.joints[-1], *stroke.lead_out], line.lead_out_feed_m_s),
    )
    for kind, joints, feed in parts:
        way, number = np.array(joints), np.arange(float(len(joints)))
        if kind == "process":
            way, number = stroke.way, stroke.at
        tips = cell.chain.frames(way).tcp
        seconds = step_lengths(tips) / feed
        timing = time_parameterize(cell.chain, way, seconds)
        nearest = np.searchsorted(np.rint(number), np.arange(len(joints)))
        timing = replace(
            timing,
            place=np.interp(timing.place, np.arange(len(way)), number),
            pace=np.minimum.reduceat(timing.pace, nearest),
        )
        works = kind == "process"
        made.append(
            Action(
                kind,  # type: ignore[arg-type]
                stroke.turn,
                timing,
                line=stroke.line,
                first=stroke.first,
                force_n=line.force_n if works else None,
                dwell_s=line.dwell_s if works else 0.0,
            )
        )
    return made
