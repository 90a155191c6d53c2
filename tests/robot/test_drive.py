"""What stands beside the surface: the tool leans away from it, and what touches is not driven."""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np
import pytest

# Not by importing it: nrdf must be first, to choose what MuJoCo draws with.
if find_spec("mujoco") is None:
    pytest.skip("pip install 'nrdf[robot]'", allow_module_level=True)

from nrdf.robot.model.arm import load_arm
from nrdf.robot.model.cell import Cell, Placement, upright_rotation
from nrdf.robot.model.signed_distance import distance_field_from_points
from nrdf.robot.model.tool import tool_of
from nrdf.robot.planning.inverse_kinematics import SeedLibrary
from nrdf.robot.planning.joint_path_planner import plan_joint_paths
from nrdf.robot.planning.program import find_home
from nrdf.robot.simulation.collision_rejection import run
from nrdf.surface.surface import Surface
from nrdf.toolpath.types import Segment, ToolPath

UP = upright_rotation(*np.eye(3)[[1, 0]])
WALL = 0.10
PLACE = Placement((0.75, 0.0, 0.3), np.pi, 0.1, (0.0,))


def block(low, high, count, rng):
    """Points on a box's faces, and their normals."""
    low, high = np.array(low), np.array(high)
    points, normals = [], []
    for axis in range(3):
        for side, face in ((-1.0, low), (1.0, high)):
            some = rng.uniform(low, high, (count, 3))
            some[:, axis] = face[axis]
            points.append(some)
            normals.append(np.tile(side * np.eye(3)[axis], (count, 1)))
    return np.concatenate(points), np.concatenate(normals)


@pytest.fixture(scope="module")
def scene():
    """A plate with a wall across it, and a line that ends beside the wall's foot."""
    rng = np.random.default_rng(0)
    plate = block((-0.15, 0.0, -0.1), (WALL, 0.03, 0.1), 1500, rng)
    wall = block((WALL, 0.0, -0.1), (WALL + 0.03, 0.12, 0.1), 1500, rng)
    points, normals = (np.concatenate(both) for both in zip(plate, wall, strict=True))
    inside = (np.abs(points[:, 0] - WALL) < 1e-9) & (points[:, 1] < 0.03)
    points, normals = points[~inside], normals[~inside]
    way = np.linspace(-0.05, WALL - 0.0165, 12)
    positions = np.stack([way, np.full(12, 0.03), np.zeros(12)], axis=1)
    down = np.tile([np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)], (12, 1))
    path = ToolPath(
        "top", "sand", "disc", 0.025, (Segment("process", 0, positions, down, 0.1, 10.0),)
    )
    distance_field = distance_field_from_points(points, normals)
    cell = Cell.build(load_arm(), tool_of(path), distance_field, PLACE, UP)
    library = SeedLibrary.build(cell, 20_000, rng)
    return cell, library, path.groups, Surface(points, normals)


@pytest.fixture(scope="module")
def strokes(scene):
    cell, library, lines, _ = scene
    return plan_joint_paths(cell, library, lines)


def test_the_tool_leans_away_from_a_wall_and_only_there(scene, strokes):
    cell, _, lines, _ = scene
    driven, covered, _ = strokes
    assert covered[0].all()
    lean = np.zeros(12)
    for s in driven:
        cosine = (s.axes * lines[0].process.axes[s.first : s.last + 1]).sum(axis=1)
        lean[s.first : s.last + 1] = np.arccos(np.clip(cosine, -1.0, 1.0))
    assert (lean[:10] < 1e-6).all()
    assert 0.01 < lean[-1] < cell.tool.max_tilt_rad + 1e-6
    tail = -next(s for s in driven if s.last == 11).axes[-1]
    assert tail[0] < -0.01


def test_a_pad_leans_as_far_as_it_gives(scene):
    cell = scene[0]
    assert cell.tool.radius_m * np.sin(cell.tool.max_tilt_rad) == pytest.approx(0.002)


def drive_it(scene, strokes, shift):
    cell, library, lines, surface = scene
    rng = np.random.default_rng(0)
    home = find_home(cell, library)
    return run(cell, "top", lines, strokes[0], home, library, rng, surface, np.array(shift))


def test_what_touches_is_left_out_and_said(scene, strokes):
    whole = drive_it(scene, strokes, (0.0, 0.0, 0.0))
    assert not whole.rejected and not whole.collisions
    # The wall comes nearer by more than the clearance that was planned with.
    done = drive_it(scene, strokes, (-0.012, 0.0, 0.0))
    assert "process" in {c.kind for c in done.rejected}
    assert not done.collisions
    left = {k for s in done.program.joint_paths for k in range(s.first, s.last + 1)}
    assert set(range(8)) <= left and 11 not in left


def test_the_object_turns_about_the_turntables_axis(scene):
    cell = scene[0]
    placed = Cell.build(
        cell.arm,
        cell.tool,
        cell.distance_field,
        Placement((0.75, 0.0, 0.3), np.pi, 0.1, (0.0, 0.7)),
        UP,
    )
    np.testing.assert_allclose(
        cell.at_turntable_angles(np.array([0.7])).T_base_object[0],
        placed.T_base_object[1],
        atol=1e-12,
    )
