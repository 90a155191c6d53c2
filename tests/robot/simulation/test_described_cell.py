"""A cell file's cell in the simulation."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from builders.cells import cell_of
from builders.export_jobs import small_job
from nrdf.cell.placement import object_pose
from nrdf.errors import LimitError

pytest.importorskip("mujoco")

from nrdf.robot.model.cell import Box
from nrdf.robot.simulation import described_cell
from nrdf.robot.simulation.described_cell import keep_out_boxes, place_in_cell

BOX = {"name": "fence", "centre_m": [1, 0, 0.5], "size_m": [0.2, 2, 1]}


def test_the_object_stands_in_the_simulation_where_the_cell_file_says(monkeypatch):
    points = np.random.default_rng(0).uniform(-0.2, 0.3, (500, 3))
    work = SimpleNamespace(job=small_job(), points=points)
    monkeypatch.setattr(
        described_cell, "replace", lambda of, **with_: SimpleNamespace(**{**vars(of), **with_})
    )
    field = SimpleNamespace(samples=points)
    for cell in (
        cell_of(robot={"floor_m": -0.7}, keep_out=[BOX]),
        cell_of(object={"fixture_m": [1.0, 0.2, 0.5], "facing_deg": 40}),
    ):
        placed, placement = place_in_cell(cell, work, field)
        pose = placement.T_base_object(field, placed.upright)[0]
        assert np.allclose(pose, object_pose(cell, small_job(), points))
        assert placement.T_cell_base()[2, 3] == pytest.approx(-cell.robot.floor_m)
        assert len(placement.keep_out) == len(cell.keep_out)


def test_distances_from_a_box_are_those_of_points_on_it():
    (box,) = keep_out_boxes(cell_of(keep_out=[{**BOX, "quaternion_xyzw": [0, 0, 1, 0]}]).keep_out)
    rng = np.random.default_rng(1)
    points = rng.uniform([0, -2, -1], [2, 2, 2], (300, 3))
    away, direction = box.distances(points)
    on = rng.uniform(-1, 1, (60_000, 3))
    face = rng.integers(0, 3, len(on))
    on[np.arange(len(on)), face] = np.sign(on[np.arange(len(on)), face])
    surface = on * [0.1, 1, 0.5] + [1, 0, 0.5]
    nearest = np.array([np.linalg.norm(surface - p, axis=1).min() for p in points])
    inside = (np.abs(points - [1, 0, 0.5]) < [0.1, 1, 0.5]).all(axis=1)
    assert inside.any() and np.array_equal(away < 0, inside)
    assert np.abs(np.abs(away) - nearest).max() < 0.03
    step = 1e-6
    ahead, _ = Box.distances(box, points + step * direction)
    assert np.allclose((ahead - away) / step, 1.0, atol=1e-3)


def test_the_tools_masses_and_the_robots_limits_are_the_cells(monkeypatch):
    points = np.random.default_rng(0).uniform(-0.2, 0.3, (500, 3))
    work = SimpleNamespace(job=small_job(), points=points)
    monkeypatch.setattr(
        described_cell, "replace", lambda of, **with_: SimpleNamespace(**{**vars(of), **with_})
    )
    field, cell = SimpleNamespace(samples=points), cell_of()
    tools = [tool.model_copy(update={"mass_kg": 1.5}) for tool in cell.tools]
    _, placement = place_in_cell(cell.model_copy(update={"tools": tools}), work, field)
    assert placement.loads == {tool.name: (1.5, (0.0, 0.0, 0.0)) for tool in tools}
    with pytest.raises(LimitError, match=r"above the cell's 1.0 mm/s"):
        place_in_cell(cell_of(robot={"max_feed_m_s": 0.001}), work, field)
