"""What the tests of the arm share: a cell with a bowl, one with a wall, a simulated plate."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import pytest

from builders.arm_cells import PLATE_PLACE, bowl_points, cell_with, path_of, wall_scene


def pytest_collection_modifyitems(items):
    # Not by importing it: nrdf must be first, to choose what MuJoCo draws with.
    if find_spec("mujoco") is None:
        for item in items:
            if item.path.is_relative_to(Path(__file__).parent):
                item.add_marker(pytest.mark.skip("pip install 'nrdf[robot]'"))


@pytest.fixture(scope="session")
def bowl():
    """The distance field of a half sphere's shell, open upwards: y is up."""
    from nrdf.robot.model.signed_distance import distance_field_from_points

    return distance_field_from_points(*bowl_points())


@pytest.fixture(scope="session")
def cell(arm, bowl):
    """The bowl before the bundled arm with a disc."""
    return cell_with(arm, path_of(), bowl)


@pytest.fixture(scope="session")
def wall(arm):
    """A plate with a wall across it, and a line that ends beside the wall's foot."""
    return wall_scene(arm)


@pytest.fixture(scope="session")
def wall_paths(wall):
    """The joint paths of the line beside the wall, what they cover, and why not more."""
    from nrdf.robot.planning.joint_path_planner import plan_joint_paths

    return plan_joint_paths(wall.cell, wall.library, wall.path.groups)


@pytest.fixture(scope="session")
def plate(plate_job, arm):
    """The plate's job, simulated."""
    from nrdf.robot.simulation.job import read_simulation_job
    from nrdf.robot.simulation.simulate import simulate

    return simulate(read_simulation_job(plate_job), arm, placement=PLATE_PLACE)
