"""The arm's program: joint paths, and the free moves and turntable moves between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from nrdf.geometry.polylines import step_lengths
from nrdf.robot.model.cell import Cell
from nrdf.robot.planning.approach_retract import lengthen
from nrdf.robot.planning.inverse_kinematics import SeedLibrary
from nrdf.robot.planning.joint_path import JointPath
from nrdf.robot.planning.motion_planner import Roadmap
from nrdf.robot.planning.slow_ends import feed_share, force_share, gun_waits
from nrdf.robot.planning.timing import FREE_SHARE, STEP_S, TimedTrajectory, time_parameterize
from nrdf.toolpath.types import SegmentGroup

FREE_M_S = 1.5
"""How fast the tool may be in free moves."""
TURNTABLE_RAD_S = np.radians(45.0)
"""How fast the turntable turns."""
_MAX_SHIFTED = 3
_FARTHEST_RAD = 5.0  # of a joint from home
_HOME_CLEARANCE_M = 0.05
_HOME_CANDIDATES, _HOME_ANGLES = 400, 36

ActionKind = Literal["transition", "approach", "process", "retract", "turntable"]


@dataclass(frozen=True)
class Action:
    """One stretch of what the arm does.

    kind: "transition" is a free move between retract and approach; at "turntable" the arm waits
    while the turntable turns. timed: joints at each step, the arm at rest at both ends. group,
    first: of a joint path, which segment group it is of and the waypoint that it begins at; -1 and
    0 elsewhere. angles_rad: (t,) of the turntable at each step where it turns, none elsewhere.
    off_surface: (t,) bool, where a process leads beyond the object's edge; tool_off: (t,) bool,
    where its gun is off; None: nowhere. force_share: (t,) of the force, where it follows the speed;
    None: all of it.
    """

    kind: ActionKind
    turntable_index: int
    timed: TimedTrajectory
    group: int = -1
    first: int = 0
    force_n: float | None = None
    dwell_s: float = 0.0
    angles_rad: np.ndarray = field(default_factory=lambda: np.zeros(0))
    off_surface: np.ndarray | None = None
    tool_off: np.ndarray | None = None
    force_share: np.ndarray | None = None


@dataclass(frozen=True)
class PathProgram:
    """The actions of one tool path.

    joint_paths: those in the program, without those that no free move leads to. given: the same as
    they were given, before joints were shifted by whole turns or free moves made longer.
    """

    actions: tuple[Action, ...]
    joint_paths: tuple[JointPath, ...]
    given: tuple[JointPath, ...]


def find_home(cell: Cell, library: SeedLibrary) -> np.ndarray:
    """Joints (n,) at which the turntable may turn: far from the object at every angle, and near the
    middle of the joints' ranges."""
    chosen = library.joints[:_HOME_CANDIDATES]
    least = np.full(len(chosen), np.inf)
    frames = cell.chain.frames(chosen)
    if len(cell.T_base_object) > 1:
        cell = cell.at_turntable_angles(np.arange(_HOME_ANGLES) * 2.0 * np.pi / _HOME_ANGLES)
    for index in range(len(cell.T_base_object)):
        found = cell.clearance(frames, np.full(len(chosen), index)).least
        least = np.minimum(least, found)
    stretch = np.abs(chosen).max(axis=1)
    score = np.minimum(least, 0.15) - 0.02 * stretch
    score[least < _HOME_CLEARANCE_M] = least[least < _HOME_CLEARANCE_M] - 1.0
    return np.asarray(chosen[int(score.argmax())])


class ProgramPlanner:
    """Plans programs for one tool path; what it has planned once it does not plan again."""

    def __init__(
        self,
        cell: Cell,
        groups: Sequence[SegmentGroup],
        home: np.ndarray,
        library: SeedLibrary,
        rng: np.random.Generator,
    ) -> None:
        self.cell, self.groups, self.home = cell, groups, home
        self._library, self._rng = library, rng
        self._roadmaps: dict[int, Roadmap] = {}
        self._connected: dict[int, tuple[JointPath, JointPath, int | None, int | None]] = {}
        self._transitions: dict[tuple[int, int, int], Action] = {}
        self._actions: dict[int, list[Action]] = {}
        self._turntable_moves: dict[tuple[int, int], Action] = {}

    def program(self, paths: Sequence[JointPath], in_order: bool = False) -> PathProgram:
        """A program from home and back to it: by turntable index, and each time the nearest joint
        path next; or, with `in_order`, as they come."""
        actions: list[Action] = []
        joint_paths, given = [], []
        index = -1
        node, at = 0, self.home
        waiting = list(paths) if in_order else _ordered(paths)
        while waiting:
            path = waiting[0]
            if not in_order:
                same = [p for p in waiting if p.turntable_index == waiting[0].turntable_index]
                path = min(same, key=lambda p: float(np.abs(p.whole()[0] - at).max()))
            waiting = [p for p in waiting if p is not path]
            connected, start, stop = self._connect(path)
            if start is None or stop is None:
                continue
            if path.turntable_index != index:
                if index >= 0 and node:
                    actions.append(self._transition(index, node, 0))
                actions.append(self._turntable_move(index, path.turntable_index))
                index, node = path.turntable_index, 0
            actions.append(self._transition(index, node, start))
            if id(connected) not in self._actions:
                group = self.groups[path.group]
                self._actions[id(connected)] = _path_actions(self.cell, group, connected)
            actions += self._actions[id(connected)]
            joint_paths.append(connected)
            given.append(path)
            node, at = stop, connected.whole()[-1]
        if node:
            actions.append(self._transition(index, node, 0))
        return PathProgram(tuple(actions), tuple(joint_paths), tuple(given))

    def _connect(self, path: JointPath) -> tuple[JointPath, int | None, int | None]:
        index = path.turntable_index
        if index not in self._roadmaps:
            self._roadmaps[index] = Roadmap(self.cell, self._library, index, self.home, self._rng)
        # With the joint path itself: its id is taken by another when it is gone.
        if id(path) not in self._connected:
            found = _connect(self._roadmaps[index], self.cell, path, self.home)
            self._connected[id(path)] = (path, *found)
        return self._connected[id(path)][1:]

    def _transition(self, index: int, one: int, other: int) -> Action:
        if (index, one, other) not in self._transitions:
            corners = self._roadmaps[index].path(one, other)
            self._transitions[index, one, other] = _free_move(self.cell, index, corners)
        return self._transitions[index, one, other]

    def _turntable_move(self, before: int, after: int) -> Action:
        if (before, after) not in self._turntable_moves:
            move = _turntable_move(self.cell, before, after, self.home)
            self._turntable_moves[before, after] = move
        return self._turntable_moves[before, after]


def _ordered(paths: Sequence[JointPath]) -> list[JointPath]:
    """By turntable index, the one where most is done first; within it in the tool path's order."""
    done = np.bincount(
        [p.turntable_index for p in paths], [len(p.joints) for p in paths], minlength=1
    )
    return sorted(
        paths, key=lambda p: (-done[p.turntable_index], p.turntable_index, p.group, p.first)
    )


def _connect(
    roadmap: Roadmap, cell: Cell, path: JointPath, home: np.ndarray
) -> tuple[JointPath, int | None, int | None]:
    """A joint path, and the nodes of its start and end; None where nothing connects them.

    Where that helps, one joint is a whole turn away, or approach and retract are longer.
    """
    alternatives = _shifted(cell, path, home)
    for other in alternatives:
        start = roadmap.connect(other.whole()[0])
        stop = None if start is None else roadmap.connect(other.whole()[-1])
        if stop is not None:
            return other, start, stop
    for other in alternatives[:_MAX_SHIFTED]:
        ends: list[int | None] = []
        for begins in (True, False):
            row = 0 if begins else -1
            node = roadmap.connect(other.whole()[row])
            if node is None:
                other = lengthen(cell, other, begins)
                node = roadmap.connect(other.whole()[row])
            ends.append(roadmap.connect_by_rrt(other.whole()[row]) if node is None else node)
            if ends[-1] is None:
                break
        else:
            return other, ends[0], ends[1]
    return path, None, None


def _shifted(cell: Cell, path: JointPath, home: np.ndarray) -> list[JointPath]:
    """The same joint path with none or one of its joints a whole turn away, those near home first.

    An upper arm reaches the same pose over the front of its column or over the back, and one of
    them may be blocked all the way.
    """
    whole = path.whole()
    low, high = whole.min(axis=0), whole.max(axis=0)
    found = [(float(np.abs(whole[0] - home).max()), path)]
    for joint in np.flatnonzero(~cell.chain.slides):
        for turn in (-2.0 * np.pi, 2.0 * np.pi):
            if low[joint] + turn < cell.chain.lower[joint]:
                continue
            if high[joint] + turn > cell.chain.upper[joint]:
                continue
            shift = turn * np.eye(cell.chain.size)[joint]
            # As far off as the joint itself is, not as whichever is farthest.
            far = float(abs(whole[0, joint] + turn - home[joint]))
            found.append((far, path.shifted(shift)))
    return [other for far, other in sorted(found, key=lambda pair: pair[0]) if far < _FARTHEST_RAD]


def _free_move(cell: Cell, turntable_index: int, corners: np.ndarray) -> Action:
    """A free move through corners (k, n), at each of which the arm stops."""
    parts = [
        time_parameterize(cell.chain, np.stack([a, b]), np.array([far / FREE_M_S]), FREE_SHARE)
        for a, b, far in zip(corners[:-1], corners[1:], _lengths(cell, corners), strict=True)
    ]
    if not parts:
        parts = [time_parameterize(cell.chain, corners[:1], np.zeros(0))]
    joined = TimedTrajectory(
        np.concatenate([part.joints for part in parts]),
        np.concatenate([part.speeds for part in parts]),
        np.concatenate([part.waypoint + i for i, part in enumerate(parts)]),
        np.ones(len(corners)),
    )
    return Action("transition", turntable_index, joined)


def _lengths(cell: Cell, corners: np.ndarray) -> np.ndarray:
    """About how far (k - 1,), m, the tool goes between corners (k, n)."""
    shares = np.linspace(0.0, 1.0, 6)[:, None]
    fine = corners[:-1, None] + shares * np.diff(corners, axis=0)[:, None]
    tips = cell.chain.frames(fine.reshape(-1, corners.shape[1])).tcp
    steps = np.diff(tips.reshape(len(corners) - 1, 6, 3), axis=1)
    return np.asarray(np.linalg.norm(steps, axis=2).sum(axis=1))


def _turntable_move(cell: Cell, before: int, after: int, home: np.ndarray) -> Action:
    """The turntable turns while the arm waits at home; the first angle is set up by hand and takes
    no time."""
    apart = 0.0
    if before >= 0:
        apart = cell.turntable_rad[after] - cell.turntable_rad[before]
        apart = (apart + np.pi) % (2.0 * np.pi) - np.pi  # the shorter way round
    count = max(int(np.ceil(abs(apart) / TURNTABLE_RAD_S / STEP_S)), 1)
    still = np.repeat(home[None], count, axis=0)
    timed = TimedTrajectory(still, 0.0 * still, np.zeros(count), np.ones(1))
    angles = cell.turntable_rad[after] - apart * np.linspace(1.0, 0.0, count + 1)[1:]
    return Action("turntable", after, timed, angles_rad=angles)


def _path_actions(cell: Cell, group: SegmentGroup, path: JointPath) -> list[Action]:
    """Approach, process and retract of a joint path."""
    process = group.process
    approach, retract = group.approach or process, group.retract or process
    into = np.array([*path.approach, path.joints[0]])
    out = np.array([path.joints[-1], *path.retract])

    # Feeds are of the ways' middles: from one to the next the speed changes evenly.
    middle = path.first + 0.5 * (path.waypoint[1:] + path.waypoint[:-1]) + 0.5
    feeds = np.interp(middle, np.arange(len(process.speeds_m_s)), process.speeds_m_s)

    def action(
        kind: ActionKind, joints: np.ndarray, number: np.ndarray, feed: float | np.ndarray
    ) -> Action:
        tips = cell.chain.frames(joints).tcp
        seconds = step_lengths(tips) / feed
        timed = time_parameterize(cell.chain, joints, seconds)
        nearest = np.searchsorted(np.rint(number), np.arange(round(number[-1]) + 1))
        timed = replace(
            timed,
            waypoint=np.interp(timed.waypoint, np.arange(len(joints)), number),
            feed_share=np.minimum.reduceat(timed.feed_share, nearest),
        )
        made = Action(kind, path.turntable_index, timed, group=path.group, first=path.first)
        if kind != "process":
            return made
        at, last = path.first + timed.waypoint, len(process.positions) - 1
        before = np.clip(np.floor(at + 1e-6).astype(int), 0, last)
        after = np.clip(np.ceil(at - 1e-6).astype(int), 0, last)
        beyond, tool_off = (
            None if there is None else ~(there[before] & there[after])
            for there in (process.on_surface, process.tool_on)
        )
        share = feed_share(cell, process, timed.joints, at)
        if process.runs_up and tool_off is not None:
            tool_off |= gun_waits(share, ~tool_off)
        return replace(
            made,
            force_n=process.force_n,
            dwell_s=process.dwell_s,
            off_surface=beyond,
            tool_off=tool_off,
            force_share=force_share(process, share),
        )

    return [
        action("approach", into, np.arange(float(len(into))), approach.feed_m_s),
        action("process", path.dense, path.waypoint, feeds),
        action("retract", out, np.arange(float(len(out))), retract.feed_m_s),
    ]
