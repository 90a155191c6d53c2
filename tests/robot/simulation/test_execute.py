from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from builders.plate_job import write_job_on
from nrdf.robot.model.cell import Placement
from nrdf.robot.simulation.execute import execute, heights
from nrdf.robot.simulation.job import read_simulation_job
from nrdf.robot.simulation.simulate import simulate
from nrdf.toolpath.frames import surface_frames
from nrdf.toolpath.types import Segment


def test_force_is_kept_over_a_bend_that_few_waypoints_tell(arm, tmp_path):
    """Between waypoints 40 degrees apart the way is straight, 3 mm below a roller's skin."""
    rng = np.random.default_rng(0)
    turn, z = rng.uniform(0.0, 2.0 * np.pi, 6000), rng.uniform(-0.15, 0.15, 6000)
    out = np.stack([np.sin(turn), np.cos(turn), 0.0 * z], axis=1)
    points = 0.05 * out + np.stack([0.0 * z, np.full(6000, 0.4), z], axis=1)
    order = np.argsort(-out[:, 1])
    at = np.radians([-60.0, -20.0, 20.0, 60.0])
    outward = np.stack([np.sin(at), np.cos(at), 0.0 * at], axis=1)
    held = Rotation.from_matrix(surface_frames(np.cross(outward, [0.0, 0.0, -1.0]), outward))
    line = 0.05 * outward + [0.0, 0.4, 0.0]
    segments = [Segment("process", 0, line, held.as_quat(), 0.04, 10.0)]
    folder = write_job_on(tmp_path, points[order], out[order], 2000, segments)
    done = simulate(
        read_simulation_job(folder), arm, placement=Placement((0.75, 0, 0.3), np.pi, 0.3, (0.0,))
    )
    assert done.paths[0].metrics.reached == 4
    assert done.paths[0].metrics.force_within > 0.95


def test_heights_are_where_the_shifted_surface_is(plate_job):
    job = read_simulation_job(plate_job)
    surface = job.surfaces.given
    positions = np.array([[0.0, 0.42, 0.0], [0.05, 0.425, 0.02], [0.0, 0.6, 0.0]])
    down = np.tile([0.0, -1.0, 0.0], (3, 1))
    found = heights(positions, down, surface, np.array([0.0, 0.003, 0.0]))
    np.testing.assert_allclose(found, [-0.003, 0.002, 1.0], atol=5e-4)


def test_actions_that_are_known_are_not_executed_again(plate):
    path = plate.paths[0]
    actions = path.program.actions[:2]
    logs = dict(zip(map(id, actions), path.logs[:2], strict=True))
    mesh = plate.simulation_job.surfaces.given
    again = execute(path.cell, actions, mesh, mesh, np.zeros(3), {id(actions[0]): path.logs[0]})
    assert again[0] is path.logs[0] and again[1] is not logs[id(actions[1])]
    np.testing.assert_allclose(again[1].joints[-1], path.logs[1].joints[-1], atol=1e-4)
