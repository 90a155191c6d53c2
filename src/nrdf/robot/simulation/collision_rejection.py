"""Rejects path sections that collide.

Planning keeps clear of everything, but the force control takes the arm off its plan, and a plan is
checked in steps. So each execution is checked as a whole. Where it collides, that part of the joint
path is rejected, and what is left is planned and executed again.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from nrdf.robot.model.cell import Cell
from nrdf.robot.planning.approach_retract import add_approach_retract
from nrdf.robot.planning.inverse_kinematics import SeedLibrary
from nrdf.robot.planning.joint_path import JointPath, densify
from nrdf.robot.planning.program import Action, PathProgram, ProgramPlanner
from nrdf.robot.simulation.collision import Collision, TimedCollision, find_collisions
from nrdf.robot.simulation.execute import ExecutionLog, execute
from nrdf.surface.target_mesh import TargetMesh
from nrdf.toolpath.types import SegmentGroup

_MAX_RUNS = 6


@dataclass(frozen=True)
class PathRun:
    """A tool path's joint paths as they are executed in the end.

    collisions: of that execution, none unless rejecting did not help; rejected: those of the runs
    before, whose path sections are left out.
    """

    program: PathProgram
    logs: tuple[ExecutionLog, ...]
    collisions: tuple[Collision, ...]
    rejected: tuple[Collision, ...]


def run(
    cell: Cell,
    region: str,
    groups: Sequence[SegmentGroup],
    paths: Sequence[JointPath],
    home: np.ndarray,
    library: SeedLibrary,
    rng: np.random.Generator,
    surface: TargetMesh,
    planned: TargetMesh,
    shift_m: np.ndarray,
    clock: Callable[[str], None] = lambda phase: None,
) -> PathRun:
    """Plan, execute and check joint paths, until nothing that is left collides.

    surface, planned: the object's true mesh and the one that was planned on. shift_m: (3,)
    by which the object is shifted, in its own frame; clock is told each phase as it ends.
    """
    planner = ProgramPlanner(cell, groups, home, library, rng)
    shifted = cell.shifted(shift_m)
    rejected: list[Collision] = []
    logs: dict[int, ExecutionLog] = {}
    collisions: dict[int, list[TimedCollision]] = {}
    for round_ in range(_MAX_RUNS):
        program = planner.program(paths, in_order=round_ > 0)
        clock("free moves")
        executed = execute(cell, program.actions, surface, planned, shift_m, logs)
        clock("simulation")
        fresh = [log for log in executed if id(log.action) not in logs]
        logs |= {id(log.action): log for log in fresh}
        collisions |= {
            id(log.action): find_collisions(shifted, region, groups, log) for log in fresh
        }
        clock("collisions")
        found = [collisions[id(action)] for action in program.actions]
        left = tuple(timed.collision for some in found for timed in some)
        # While the turntable turns the arm only waits.
        avoidable = [
            k for k, action in enumerate(program.actions) if found[k] and action.kind != "turntable"
        ]
        if not avoidable or round_ + 1 == _MAX_RUNS:
            break
        rejected += [timed.collision for k in avoidable for timed in found[k]]
        steps = {k: np.any([timed.steps for timed in found[k]], axis=0) for k in avoidable}
        paths = _reject(cell, groups, program, executed, steps)
        clock("inverse kinematics")
    return PathRun(program, tuple(executed), left, tuple(rejected))


def _reject(
    cell: Cell,
    groups: Sequence[SegmentGroup],
    program: PathProgram,
    logs: Sequence[ExecutionLog],
    colliding: Mapping[int, np.ndarray],
) -> list[JointPath]:
    """The joint paths, in the program's order, without the parts that collide.

    colliding: by the index of an action, at which of its steps (t,).
    """
    parts: dict[tuple[int, int], list[JointPath]] = {}
    for index, steps in colliding.items():
        action = program.actions[index]
        owner = _process_beside(program.actions, index) if action.kind == "transition" else action
        key = (owner.group, owner.first)
        parts.setdefault(key, [])
        if action.kind == "process":
            path = next(p for p in program.given if (p.group, p.first) == key)
            parts[key] = _split(path, logs[index].waypoint[steps])
    rest = [part for some in parts.values() for part in some]
    again: dict[int, JointPath | None] = {}
    if rest:
        dense = [path for path, _ in densify(cell, groups, rest)]
        found = add_approach_retract(cell, groups, dense)
        again = {id(part): path for part, path in zip(rest, found, strict=True)}
    left: list[JointPath | None] = []
    for path in program.given:
        key = (path.group, path.first)
        if key in parts:
            left += [again[id(part)] for part in parts[key]]
        else:
            left.append(path)
    return [path for path in left if path is not None]


def _process_beside(actions: Sequence[Action], index: int) -> Action:
    """The process action that a transition leads to, or, where it leads home, comes from."""
    after = [a for a in actions[index:] if a.kind == "process"]
    before = [a for a in actions[:index] if a.kind == "process"]
    leads_on = index + 1 < len(actions) and actions[index + 1].kind == "approach"
    return after[0] if leads_on else before[-1]


def _split(path: JointPath, hit: np.ndarray) -> list[JointPath]:
    """A joint path's parts before and after the waypoint numbers (k,) at which it collides."""
    before, after = int(np.floor(hit.min())), int(np.ceil(hit.max()))
    made = []
    for first, last in ((0, before - 1), (after + 1, len(path.joints) - 1)):
        if last >= first:
            part = slice(first, last + 1)
            made.append(
                JointPath(
                    path.group, path.first + first, path.first + last, path.turntable_index,
                    path.axes[part], path.joints[part],
                )
            )  # fmt: skip
    return made
