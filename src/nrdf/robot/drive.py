"""Nothing is driven that touches what it should not: such moves are left out.

Planning keeps clear of everything, but the force control takes the arm off its plan, and a plan is
looked at in steps. So each drive is looked at as a whole; where something touched, that part of the
stroke is left out, and what is left is planned and driven again.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from nrdf.process.surface import Surface
from nrdf.robot.cell import Cell
from nrdf.robot.collision import Collision, Touch, find_touches
from nrdf.robot.execute import Log, execute
from nrdf.robot.inverse import Library
from nrdf.robot.lines import Line
from nrdf.robot.program import Action, PathProgram, program
from nrdf.robot.strokes import Piece, Stroke, between, with_leads

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
    avoided: list[Collision] = []
    for round_ in range(_MOST_DRIVES):
        planned = program(cell, lines, strokes, home, library, rng)
        clock("free moves")
        logs = execute(cell, planned.actions, surface, shift_m)
        clock("simulation")
        touches = find_touches(cell.shifted(shift_m), region, lines, logs)
        clock("collisions")
        collisions = tuple(touch.collision for touch in touches)
        # The arm only waits while the object turns.
        avoidable = [touch for touch in touches if touch.collision.kind != "turn"]
        if not avoidable or round_ + 1 == _MOST_DRIVES:
            break
        avoided += collisions
        strokes = _without(cell, lines, planned, avoidable, logs)
        clock("inverse kinematics")
    return Drive(planned, tuple(logs), collisions, tuple(avoided))


def _without(
    cell: Cell,
    lines: Sequence[Line],
    planned: PathProgram,
    touches: Sequence[Touch],
    logs: Sequence[Log],
) -> list[Stroke]:
    """The driven strokes without the parts in which something is touched."""
    left = {(s.line, s.first): s for s in planned.strokes}
    pieces: list[Piece] = []
    for touch in touches:
        action = planned.actions[touch.action]
        if action.kind == "free":
            action = _works_next(planned.actions, touch.action)
        stroke = left.pop((action.line, action.first), None)
        # A stroke may touch in more than one of its moves.
        if stroke is not None and action.kind == "process" and touch.collision.kind == "process":
            pieces += _parts(stroke, logs[touch.action].place[touch.steps])
    again: list[Stroke | None] = []
    if pieces:
        ways = [(way, at) for way, at, _ in between(cell, lines, pieces)]
        again = with_leads(cell, lines, pieces, ways)
    return [*left.values(), *(stroke for stroke in again if stroke is not None)]


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
