from __future__ import annotations

import numpy as np
import pytest
import trimesh

from builders.solids import box
from nrdf.errors import RobotError
from nrdf.robot.model.signed_distance import (
    _without_specks,
    distance_field_from_file,
    distance_field_from_mesh,
    distance_field_from_points,
)


def test_a_concave_object_is_not_swallowed_by_its_hull(bowl):
    middle, wall, below = np.array([[0.0, -0.05, 0.0], [0.0, -0.185, 0.0], [0.0, -0.225, 0.0]])
    away = bowl.distances(np.array([middle, wall, below]))[0]
    assert away[0] == pytest.approx(0.12, abs=0.012)
    assert away[1] < 0.0
    assert away[2] == pytest.approx(0.025, abs=0.004)


def test_single_nodes_on_the_wrong_side_are_no_part_of_a_solid():
    value = np.zeros((12, 12, 12))
    value[2:9, 2:9, 2:9] = 1.0
    wrong = value.copy()
    wrong[10, 10, 10], wrong[5, 5, 5] = 1.0, 0.0
    wrong[0, 0, :2] = 0.9
    np.testing.assert_array_equal(_without_specks(wrong), value)


def test_a_meshs_distances_are_signed_and_its_gradient_points_away():
    mesh = trimesh.creation.box((0.2, 0.2, 0.2))
    field = distance_field_from_mesh(mesh.vertices, mesh.faces)
    away, gradient = field.distances(np.array([[0.12, 0.0, 0.0], [0.0, 0.08, 0.0]]))
    np.testing.assert_allclose(away, [0.02, -0.02], atol=0.003)
    np.testing.assert_allclose(gradient, [[1, 0, 0], [0, 1, 0]], atol=0.1)


def test_a_mesh_file_must_be_where_the_points_are(tmp_path):
    points, _ = box((0.2, 0.2, 0.2), 500)
    file = tmp_path / "box.ply"
    trimesh.creation.box((0.2, 0.2, 0.2)).export(file)
    assert distance_field_from_file(file, points).origin == "mesh box.ply"
    with pytest.raises(RobotError, match="it must be in metres, in the job's frame"):
        distance_field_from_file(file, 1000 * points)


def test_an_object_too_large_for_one_arm():
    points, normals = box((20.0, 20.0, 20.0), 500)
    with pytest.raises(RobotError, match=r"measures 20\.00 x 20\.00 x 20\.00 m, too large"):
        distance_field_from_points(points, normals)
