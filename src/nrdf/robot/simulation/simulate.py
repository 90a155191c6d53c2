"""A job on an arm, from placement to metrics: what `nrdf simulate` does before it writes."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from nrdf.errors import RobotError
from nrdf.robot.model.arm import Arm
from nrdf.robot.model.cell import Cell, Placement
from nrdf.robot.model.signed_distance import (
    SignedDistanceField,
    distance_field_from_mesh,
    distance_field_from_points,
)
from nrdf.robot.model.tool import tool_of
from nrdf.robot.planning.inverse_kinematics import SeedLibrary
from nrdf.robot.planning.joint_path_planner import plan_joint_paths
from nrdf.robot.planning.placement import find_placement
from nrdf.robot.planning.program import PathProgram, find_home
from nrdf.robot.simulation.collision import Collision
from nrdf.robot.simulation.collision_rejection import run
from nrdf.robot.simulation.execute import ExecutionLog
from nrdf.robot.simulation.executed_result import ExecutedResult, executed_result
from nrdf.robot.simulation.job import SimulationJob
from nrdf.robot.simulation.metrics import PathMetrics, measure_path
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.types import ToolPath

LIBRARY_SIZE = 40_000


@dataclass(frozen=True)
class SimulatedPath:
    """One tool path on the arm. collisions, rejected: as a `PathRun` has them. result: the film or
    depth that it left, where its process has a target."""

    path: ToolPath
    strategy: Strategy
    cell: Cell
    program: PathProgram
    logs: tuple[ExecutionLog, ...]
    collisions: tuple[Collision, ...]
    rejected: tuple[Collision, ...]
    metrics: PathMetrics
    result: ExecutedResult | None = None

    def line(self, log: ExecutionLog) -> int:
        """The number of the line that a log's action is on; -1 between lines."""
        group = log.action.group
        return self.path.groups[group].process.line if group >= 0 else -1


@dataclass(frozen=True)
class SimulationResult:
    """A job, simulated.

    reachable: share of a sample of waypoints that the placement reaches. shift_m: (3,) by which the
    object was shifted. seconds: of processor time by phase.
    """

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
    turntable_positions: int = 12,
    shift_m: Sequence[float] = (0.0, 0.0, 0.0),
    seed: int = 0,
    progress: Callable[[str], None] = lambda what: None,
) -> SimulationResult:
    """Simulate a job on an arm.

    distance_field: of the object, from its surface unless given; placement: searched for unless
    given, with the turntable at any of `turntable_positions` angles. Raises RobotError where
    nothing can be reached.
    """
    rng = np.random.default_rng(seed)
    clock = _Clock()
    surfaces = simulation_job.surfaces
    progress("shape of the object")
    if distance_field is None:
        distance_field = object_distance_field(simulation_job)
    clock("shape")
    progress("placement")
    upright, paths = simulation_job.upright, simulation_job.job.paths
    placement, reachable = find_placement(
        arm, paths, distance_field, upright, placement, turntable_positions, rng
    )
    if reachable == 0.0:
        raise RobotError(
            f"the arm '{arm.name}' reaches none of the job's waypoints from its base at "
            f"{' '.join(f'{x:.2f}' for x in placement.base_m)} m: place it nearer, let the object "
            "turn (--turns), or take --base auto"
        )
    clock("placement")
    simulated = []
    home: np.ndarray | None = None
    library: SeedLibrary | None = None
    shift = np.asarray(shift_m, float)
    for path, strategy in zip(paths, simulation_job.strategies, strict=True):
        where = f"{path.region}, {path.process}"
        progress(f"{where}: inverse kinematics")
        tool = replace(tool_of(path), load=placement.loads.get(path.tool))
        cell = Cell.build(arm, tool, distance_field, placement, upright)
        if library is None or not np.array_equal(library.T_flange_tcp, cell.tool.T_flange_tcp):
            library = SeedLibrary.build(cell, LIBRARY_SIZE, rng)
        joint_paths, covered, reachability = plan_joint_paths(cell, library, path.groups)
        clock("inverse kinematics")
        home = find_home(cell, library) if home is None else home
        progress(f"{where}: simulation")
        done = run(
            cell, path.region, path.groups, joint_paths, home, library, rng, surfaces.given,
            surfaces.planned, shift, clock,
        )  # fmt: skip
        region = surfaces.regions[path.region]
        metrics = measure_path(
            region, path, strategy, cell, done.program, covered, reachability, done.logs
        )
        process = simulation_job.process_of(path)
        left = None
        if process is not None:
            left = executed_result(process, region, path, cell, done.logs, shift)
        clock("metrics")
        simulated.append(
            SimulatedPath(
                path, strategy, cell, done.program, done.logs, done.collisions, done.rejected,
                metrics, left,
            )
        )  # fmt: skip
    if not any(p.metrics.reached for p in simulated):
        raise RobotError(f"the arm '{arm.name}' can execute none of the job's lines")
    return SimulationResult(
        simulation_job, arm, distance_field, placement, reachable, tuple(simulated), shift,
        clock.seconds,
    )  # fmt: skip


def object_distance_field(simulation_job: SimulationJob) -> SignedDistanceField:
    """The shape of a job's object, from its surface."""
    surfaces = simulation_job.surfaces
    if surfaces.exact:
        mesh = surfaces.given
        return distance_field_from_mesh(mesh.vertices, mesh.faces, surfaces.origin)
    # A scan's mesh has holes, which its points' winding number closes.
    return distance_field_from_points(simulation_job.points, simulation_job.normals)


class _Clock:
    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._last = time.process_time()

    def __call__(self, phase: str) -> None:
        now = time.process_time()
        self.seconds[phase] = self.seconds.get(phase, 0.0) + now - self._last
        self._last = now
