"""What the simulated arm really leaves of a plan, on the mesh that was given."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nrdf.process_model.executed import executed_values, measure_executed
from nrdf.process_model.plan import PlannedResult
from nrdf.process_model.result import ResultMetrics, Target
from nrdf.process_model.result_model import Tool
from nrdf.robot.model.arm import load_arm
from nrdf.robot.model.cell import Cell, upright_rotation
from nrdf.robot.model.signed_distance import distance_field_from_mesh
from nrdf.robot.model.tool import tool_of
from nrdf.robot.planning.inverse_kinematics import SeedLibrary
from nrdf.robot.planning.joint_path_planner import plan_joint_paths
from nrdf.robot.planning.placement import find_placement
from nrdf.robot.planning.program import find_home
from nrdf.robot.simulation.collision_rejection import run
from nrdf.robot.simulation.executed_result import executed_motion
from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.types import ToolPath

_LIBRARY, _TURNS = 40_000, 12  # poses to begin from, as `nrdf simulate` has; turns of the table


@dataclass(frozen=True)
class Execution:
    """Of one plan. metrics: of what the arm left; reached: share of the waypoints with the gun on
    that it came to."""

    metrics: ResultMetrics
    reached: float


def execute_on_arm(
    region: RegionMesh,
    planned: PlannedResult,
    tool: Tool,
    target: Target,
    up: np.ndarray,
    forward: np.ndarray,
    radius_m: float,
    poses: int = _LIBRARY,
    turns: int = _TURNS,
) -> Execution:
    """A plan on the bundled arm, which stands where it reaches most, the object on a turntable.

    up, forward: (3,) of the object; poses: of the arm, that its searches begin from; turns: of
    the table. Raises RobotError where it reaches nothing.
    """
    arm, rng = load_arm(), np.random.default_rng(0)
    path = ToolPath("region", "process", "tool", radius_m, planned.segments)
    mesh, upright, still = (
        region.parent,
        upright_rotation(up, forward),
        np.zeros(3),
    )
    field = distance_field_from_mesh(mesh.vertices, mesh.faces, "the mesh that was given")
    placement, _ = find_placement(arm, [path], field, upright, None, turns, rng)
    cell = Cell.build(arm, tool_of(path), field, placement, upright)
    library = SeedLibrary.build(cell, poses, rng)
    joint_paths, covered, _ = plan_joint_paths(cell, library, path.groups)
    done = run(
        cell, path.region, path.groups, joint_paths, find_home(cell, library), library, rng, mesh,
        mesh, still,
    )  # fmt: skip
    motion = executed_motion(cell, done.logs, still)
    cells = planned.model.cells
    values = executed_values(cells, motion, tool, mesh)
    worked = np.concatenate([group.process.applies for group in path.groups])
    reached = float(np.concatenate(covered)[worked].mean())
    return Execution(measure_executed(cells, values, motion, tool, target), reached)
