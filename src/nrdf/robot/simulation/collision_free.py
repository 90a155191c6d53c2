"""Nothing is driven that touches what it should not: such moves are left out.

Planning keeps clear of everything, but the force control takes the arm off its plan, and a plan is
looked at in steps. So each drive is looked at as a whole; where something touched, that part of the
stroke is left out, and what is left is planned and driven again.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from nrdf.robot.model.cell import Cell
from nrdf.robot.planning.inverse_kinematics import Library
from nrdf.robot.planning.joint_paths import Piece, Stroke, add_approach_retract, between
from nrdf.robot.planning.lines import Line
from nrdf.robot.planning.program import Action, PathProgram, Planner
from nrdf.robot.simulation.collision import Collision, TimedCollision, find_collisions
from nrdf.robot.simulation.execute import Log, execute
from nrdf.surface.surface import Surface

_MOST_DRIVES = 6


@dataclass(frozen=True)
class Drive:
    """A tool path's strokes as they are driven in the end.

    collisions: of that drive, none unless leaving out did not help; avoided: those of the drives
    before, whose moves are left out.
    """

    program: PathProgram
    logs: tuple[Log, ...]
    collisions: tuple[Collision, ...]
    avoided: tuple[Collision, ...]


def drive(
    cell: Cell,
    region: str,
    lines: Sequence[Line],
    strokes: Sequence[Stroke],
    home: np.ndarray,
    library: Library,
    rng: np.random.Generator,
    surface: Surface,
    shift_m: np.ndarray,
    clock: Callable[[str], None] = lambda phase: None,
) -> Drive:
    """Plan, execute and look at strokes, until no move that is left touches anything.

    shift_m: (3,) by which the object is off its place, in its own frame; clock is told each phase
    as it ends.
    """
    planner = Planner(cell, lines, home, library, rng)
    there = cell.shifted(shift_m)
    avoided: list[Collision] = []
    logs: dict[int, Log] = {}
    touches: dict[int, list[TimedCollision]] = {}
    for round_ in range(_MOST_DRIVES):
        planned = planner.program(strokes, in_order=round_ > 0)
        clock("free moves")
        driven = execute(cell, planned.actions, surface, shift_m, logs)
        clock("simulation")
        fresh = [log for log in driven if id(log.action) not in logs]
        logs |= {id(log.action): log for log in fresh}
        touches |= {id(log.action): find_collisions(there, region, lines, log) for log in fresh}
        clock("collisions")
        found = [touches[id(action)] for action in planned.actions]
        collisions = tuple(touch.collision for one in found for touch in one)
        # While the object turns the arm only waits.
        avoidable = [k for k, a in enumerate(planned.actions) if found[k] and a.kind != "turn"]
        if not avoidable or round_ + 1 == _MOST_DRIVES:
            break
        avoided += [touch.collision for k in avoidable for touch in found[k]]
        steps = {k: np.any([touch.steps for touch in found[k]], axis=0) for k in avoidable}
        strokes = _without(cell, lines, planned, driven, steps)
        clock("inverse kinematics")
    return Drive(planned, tuple(driven), collisions, tuple(avoided))


def _without(
    cell: Cell,
    lines: Sequence[Line],
    planned: PathProgram,
    logs: Sequence[Log],
    touching: Mapping[int, np.ndarray],
) -> list[Stroke]:
    """The strokes, in driving order, without the parts in which something is touched.

    touching: by the index of an action, at which of its steps.
    """
    parts: dict[tuple[int, int], list[Piece]] = {}
    for index, steps in touching.items():
        action = planned.actions[index]
        works = _works_next(planned.actions, index) if action.kind == "free" else action
        key = (works.line, works.first)
        parts.setdefault(key, [])
        if action.kind == "process":
            stroke = next(s for s in planned.given if (s.line, s.first) == key)
            parts[key] = _parts(stroke, logs[index].place[steps])
    pieces = [piece for some in parts.values() for piece in some]
    again: dict[int, Stroke | None] = {}
    if pieces:
        ways = [(way, at) for way, at, _ in between(cell, lines, pieces)]
        found = add_approach_retract(cell, lines, pieces, ways)
        again = {id(piece): stroke for piece, stroke in zip(pieces, found, strict=True)}
    left: list[Stroke | None] = []
    for stroke in planned.given:
        key = (stroke.line, stroke.first)
        if key in parts:
            left += [again[id(piece)] for piece in parts[key]]
        else:
            left.append(stroke)
    return [stroke for stroke in left if stroke is not None]


def _works_next(actions: Sequence[Action], index: int) -> Action:
    """The stroke that a free move leads to, or, where it leads home, comes from."""
    after = [a for a in actions[index:] if a.kind == "process"]
    before = [a for a in actions[:index] if a.kind == "process"]
    leads_on = index + 1 < len(actions) and actions[index + 1].kind == "approach"
    return after[0] if leads_on else before[-1]


def _parts(stroke: Stroke, hit: np.ndarray) -> list[Piece]:
    """A stroke's parts before and after places (k,) on it at which it touches."""
    before, after = int(np.floor(hit.min())), int(np.ceil(hit.max()))
    made = []
    for first, last in ((0, before - 1), (after + 1, len(stroke.joints) - 1)):
        if last >= first:
            part = slice(first, last + 1)
            made.append(
                Piece(
                    stroke.line, stroke.first + first, stroke.first + last, stroke.turn,
                    stroke.axes[part], stroke.joints[part],
                )
            )  # fmt: skip
    return made
