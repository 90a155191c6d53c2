"""A job on an arm, from reach to coverage: what `nrdf simulate` does before it writes."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from nrdf.errors import ProcessError, RobotError
from nrdf.geometry.similarity import up_axis
from nrdf.process.bound_knowledge import BoundKnowledge, read_bound_knowledge
from nrdf.process.knowledge import Process
from nrdf.reports.job_folder import KNOWLEDGE
from nrdf.robot.model.arm import Arm
from nrdf.robot.model.cell import Cell, Placement, upright_turn
from nrdf.robot.model.signed_distance import SignedDistanceField, solid_from_points
from nrdf.robot.model.tool import tool_of
from nrdf.robot.planning.follow import follow
from nrdf.robot.planning.inverse_kinematics import Library
from nrdf.robot.planning.lines import Line, lines_of
from nrdf.robot.planning.placement import find_placement
from nrdf.robot.planning.program import PathProgram, find_home
from nrdf.robot.report.outcome import Outcome, outcome
from nrdf.robot.simulation.collision import Collision
from nrdf.robot.simulation.collision_free import drive
from nrdf.robot.simulation.execute import Log
from nrdf.surface.surface import Surface
from nrdf.toolpath.file import read_toolpaths
from nrdf.toolpath.types import Job, ToolPath

log = logging.getLogger(__name__)

LIBRARY_SIZE = 40_000
_FARTHEST_M = 0.05  # that a waypoint may be from the object, beyond the process's stand-off


@dataclass(frozen=True)
class Work:
    """A job with the object that it is for.

    lesson: the job's own knowledge: the target in metres with its regions. processes: of each of
    the job's paths. upright: (3, 3), from the target's frame to one with z up and x where the
    object faces; origin: where that is from, in words; assumed: whether nothing says it.
    """

    job: Job
    lesson: BoundKnowledge
    processes: tuple[Process, ...]
    upright: np.ndarray
    origin: str
    assumed: bool = False

    @property
    def points(self) -> np.ndarray:
        return self.lesson.cloud.points

    @property
    def normals(self) -> np.ndarray:
        normals = self.lesson.cloud.normals
        assert normals is not None  # read_work lets no other pass
        return normals


@dataclass(frozen=True)
class DrivenPath:
    """One tool path on the arm. collisions, avoided: as a `Drive` has them."""

    path: ToolPath
    process: Process
    cell: Cell
    lines: tuple[Line, ...]
    program: PathProgram
    logs: tuple[Log, ...]
    collisions: tuple[Collision, ...]
    avoided: tuple[Collision, ...]
    outcome: Outcome


@dataclass(frozen=True)
class Simulated:
    """A job, driven. seconds: of processor time by phase; shift_m: of the object off its place."""

    work: Work
    arm: Arm
    solid: SignedDistanceField
    placement: Placement
    reachable: float
    paths: tuple[DrivenPath, ...]
    shift_m: np.ndarray
    seconds: dict[str, float]


def read_work(folder: str | Path, up: str | None = None) -> Work:
    """A job's folder, as `nrdf transfer` writes it.

    up: an axis of the job's frame ("x" to "-z"), or "x y z", instead of what the job says.

    Raises ProcessError where it is no such folder, or where its tool paths and its object do not
    fit each other: another frame or unit.
    """
    folder = Path(folder)
    job = read_toolpaths(folder)
    if not folder.is_dir():
        folder = folder.parent
    if not (folder / KNOWLEDGE).is_file():
        raise ProcessError(
            f"{folder} has no {KNOWLEDGE}, which says what the tool paths are on; give the whole "
            "folder that `nrdf transfer` wrote"
        )
    lesson = read_bound_knowledge(folder / KNOWLEDGE)
    if not job.paths:
        raise ProcessError("the job has no tool paths: no region was found or planned")
    frame = lesson.cloud.frame or "target"
    if job.frame != frame:
        raise ProcessError(
            f"the job's tool paths are in the frame '{job.frame}', its object in '{frame}'; "
            "transfer it again, so that both are in one"
        )
    if lesson.cloud.normals is None:
        raise ProcessError(f"the job's {lesson.knowledge.reference.cloud} has no normals")
    processes = tuple(_process(lesson, path) for path in job.paths)
    work = Work(job, lesson, processes, *_lying(job, up))
    _check_frame(work)
    return work


def _process(lesson: BoundKnowledge, path: ToolPath) -> Process:
    regions = [region for region in lesson.knowledge.regions if region.name == path.region]
    made = [p for region in regions for p in region.processes if p.label == path.process]
    if len(made) == 1:
        return made[0]
    what = f"the job's tool path '{path.process}' on '{path.region}'"
    if made:  # an early job: since then each has a label of its own
        raise ProcessError(
            f"{what} may be of {len(made)} processes of that name in its {KNOWLEDGE}; transfer it "
            "again, or name each of them"
        )
    raise ProcessError(f"{what} is not in its {KNOWLEDGE}; transfer it again")


def _lying(job: Job, up: str | None) -> tuple[np.ndarray, str, bool]:
    """`Work.upright`, where it is from, and whether it is assumed."""
    if up is not None:
        return upright_turn(up_axis(up), job.forward), f"up is {up}, as given", False
    upright = upright_turn(job.up, job.forward)
    if job.pose is None:
        said = "the job does not say how its object lies: taken to have +Y up and +X ahead"
        return upright, said, True
    return upright, "the object stands as the job's pose says", False


def _check_frame(work: Work) -> None:
    """Raise ProcessError where the tool paths are not on the object."""
    surface = Surface(work.points, work.normals)
    for path, process in zip(work.job.paths, work.processes, strict=True):
        places = [s.positions for s in path.segments if s.kind == "process"]
        if not places:
            raise ProcessError(f"the tool path on '{path.region}' has no process segment")
        far = surface.tree.query(np.concatenate(places))[0] - process.standoff_m
        typical = float(np.median(far))
        if typical > _FARTHEST_M:
            size = float(np.ptp(work.points, axis=0).max())
            raise ProcessError(
                f"the tool path on '{path.region}' is {typical:.3g} m from the object, which "
                f"measures {size:.3g} m: the two are in different units or frames; both must be in "
                "metres, in the target's frame"
            )


def simulate(
    work: Work,
    arm: Arm,
    solid: SignedDistanceField | None = None,
    placement: Placement | None = None,
    turns: int = 12,
    shift_m: Sequence[float] = (0.0, 0.0, 0.0),
    seed: int = 0,
    progress: Callable[[str], None] = lambda what: None,
) -> Simulated:
    """Drive a job on an arm, in simulation.

    solid: the object's shape, from its points unless given; placement: searched for unless given,
    with the object at any of `turns` turns. Raises RobotError where nothing can be reached.
    """
    rng = np.random.default_rng(seed)
    clock = _Clock()
    surface = Surface(work.points, work.normals)
    progress("shape of the object")
    if solid is None:
        solid = solid_from_points(work.points, work.normals)
    clock("shape")
    progress("placement")
    every = [(path, lines_of(path)) for path in work.job.paths]
    placement, reachable = find_placement(arm, every, solid, work.upright, placement, turns, rng)
    if reachable == 0.0:
        raise RobotError(
            f"the arm '{arm.name}' reaches none of the job's waypoints from its base at "
            f"{' '.join(f'{x:.2f}' for x in placement.base_m)} m: place it nearer, let the object "
            "turn (--turns), or take --base auto"
        )
    clock("placement")
    paths = []
    home: np.ndarray | None = None
    library: Library | None = None
    for path, process in zip(work.job.paths, work.processes, strict=True):
        where = f"{path.region}, {path.process}"
        progress(f"{where}: inverse kinematics")
        cell = Cell.build(arm, tool_of(path), solid, placement, work.upright)
        if library is None or not np.array_equal(library.T_flange_tcp, cell.tool.T_flange_tcp):
            library = Library.build(cell, LIBRARY_SIZE, rng)
        lines = lines_of(path)
        strokes, covered, why = follow(cell, library, lines)
        clock("inverse kinematics")
        home = find_home(cell, library) if home is None else home
        progress(f"{where}: simulation")
        done = drive(
            cell, path.region, lines, strokes, home, library, rng, surface,
            np.asarray(shift_m, float), clock,
        )  # fmt: skip
        result = outcome(
            work.lesson, surface, path, process, cell, lines, done.program, covered, why, done.logs
        )
        clock("figures")
        paths.append(
            DrivenPath(
                path, process, cell, lines, done.program, done.logs, done.collisions,
                done.avoided, result,
            )
        )  # fmt: skip
    if not any(p.outcome.reached for p in paths):
        raise RobotError(f"the arm '{arm.name}' can drive none of the job's lines")
    return Simulated(
        work, arm, solid, placement, reachable, tuple(paths), np.asarray(shift_m, float),
        clock.seconds,
    )  # fmt: skip


class _Clock:
    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._last = time.process_time()

    def __call__(self, phase: str) -> None:
        now = time.process_time()
        self.seconds[phase] = self.seconds.get(phase, 0.0) + now - self._last
        self._last = now
