from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from builders.plate_job import write_job_on
from nrdf.geometry.polylines import resample
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


def run_off_job(folder, marked):
    """Two lines on a plate, joined 60 mm beyond its edge."""
    rng = np.random.default_rng(0)
    flat = rng.uniform(-0.15, 0.15, (2500, 2))
    top = np.stack([flat[:, 0], np.full(2500, 0.42), flat[:, 1]], axis=1)
    up = np.tile([0.0, 1.0, 0.0], (2500, 1))
    corners = np.array([[0.0, -0.03], [0.21, -0.03], [0.21, 0.03], [0.0, 0.03]])
    at = resample(corners, 0.015)
    line = np.stack([at[:, 0], np.full(len(at), 0.42), at[:, 1]], axis=1)
    held = np.tile([np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)], (len(line), 1))
    over = line[:, 0] < 0.15 if marked else None
    stroke = Segment("process", 0, line, held, 0.05, 10.0, on_surface=over)
    points, normals = np.concatenate([top, top - [0.0, 0.03, 0.0]]), np.concatenate([up, -up])
    return write_job_on(folder, points, normals, 2500, [stroke])


def test_beyond_an_edge_the_tool_is_held_where_it_was_planned(arm, tmp_path):
    place = Placement((0.75, 0, 0.3), np.pi, 0.3, (0.0,))
    within, depth = {}, {}
    for marked in (True, False):
        (folder := tmp_path / str(marked)).mkdir()
        (path,) = simulate(
            read_simulation_job(run_off_job(folder, marked)), arm, placement=place
        ).paths
        within[marked] = path.metrics.force_within
        tips = np.concatenate([log.tip for log in path.logs if log.action.kind == "process"])
        depth[marked] = 0.42 - tips[tips[:, 0] > 0.19, 1].min()
    assert within[True] > 0.95 > within[False]
    assert depth[True] < 5e-3 < depth[False]
