"""A job on an arm, from reach to coverage: what `nrdf simulate` does before it writes."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from nrdf.errors import RobotError
from nrdf.process.knowledge import Process
from nrdf.robot.model.arm import Arm
from nrdf.robot.model.cell import Cell, Placement
from nrdf.robot.model.signed_distance import SignedDistanceField, distance_field_from_points
from nrdf.robot.model.tool import tool_of
from nrdf.robot.planning.follow import follow
from nrdf.robot.planning.inverse_kinematics import Library
from nrdf.robot.planning.lines import Line, lines_of
from nrdf.robot.planning.placement import find_placement
from nrdf.robot.planning.program import PathProgram, find_home
from nrdf.robot.simulation.collision import Collision
from nrdf.robot.simulation.collision_free import drive
from nrdf.robot.simulation.execute import Log
from nrdf.robot.simulation.job import SimulationJob
from nrdf.robot.simulation.metrics import PathMetrics, measure_path
from nrdf.surface.surface import Surface
from nrdf.toolpath.types import ToolPath

log = logging.getLogger(__name__)

LIBRARY_SIZE = 40_000


@dataclass(frozen=True)
class SimulatedPath:
    """One tool path on the arm. collisions, avoided: as a `Drive` has them."""

    path: ToolPath
    process: Process
    cell: Cell
    lines: tuple[Line, ...]
    program: PathProgram
    logs: tuple[Log, ...]
    collisions: tuple[Collision, ...]
    avoided: tuple[Collision, ...]
    metrics: PathMetrics


@dataclass(frozen=True)
class SimulationResult:
    """A job, driven. seconds: of processor time by phase; shift_m: of the object off its place."""

    simulation_job: SimulationJob
    arm: Arm
    distance_field: SignedDistanceField
    placement: Placement
    reachable: float
    paths: tuple[SimulatedPath, ...]
    shift_m: np.ndarray
    seconds: dict[str, float]


def simulate(
    simulation_job: SimulationJob,
    arm: Arm,
    distance_field: SignedDistanceField | None = None,
    placement: Placement | None = None,
    turns: int = 12,
    shift_m: Sequence[float] = (0.0, 0.0, 0.0),
    seed: int = 0,
    progress: Callable[[str], None] = lambda what: None,
) -> SimulationResult:
    """Drive a job on an arm, in simulation.

    distance_field: the object's shape, from its points unless given; placement: searched for unless
    given, with the object at any of `turns` turns. Raises RobotError where nothing can be reached.
    """
    rng = np.random.default_rng(seed)
    clock = _Clock()
    surface = Surface(simulation_job.points, simulation_job.normals)
    progress("shape of the object")
    if distance_field is None:
        distance_field = distance_field_from_points(simulation_job.points, simulation_job.normals)
    clock("shape")
    progress("placement")
    every = [(path, lines_of(path)) for path in simulation_job.job.paths]
    placement, reachable = find_placement(
        arm, every, distance_field, simulation_job.upright, placement, turns, rng
    )
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
    for path, process in zip(simulation_job.job.paths, simulation_job.processes, strict=True):
        where = f"{path.region}, {path.process}"
        progress(f"{where}: inverse kinematics")
        cell = Cell.build(arm, tool_of(path), distance_field, placement, simulation_job.upright)
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
        metrics = measure_path(
            simulation_job.bound_knowledge,
            surface,
            path,
            process,
            cell,
            lines,
            done.program,
            covered,
            why,
            done.logs,
        )
        clock("metrics")
        paths.append(
            SimulatedPath(
                path, process, cell, lines, done.program, done.logs, done.collisions,
                done.avoided, metrics,
            )
        )  # fmt: skip
    if not any(p.metrics.reached for p in paths):
        raise RobotError(f"the arm '{arm.name}' can drive none of the job's lines")
    return SimulationResult(
        simulation_job, arm, distance_field, placement, reachable, tuple(paths),
        np.asarray(shift_m, float), clock.seconds,
    )  # fmt: skip


class _Clock:
    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._last = time.process_time()

    def __call__(self, phase: str) -> None:
        now = time.process_time()
        self.seconds[phase] = self.seconds.get(phase, 0.0) + now - self._last
        self._last = now
