from __future__ import annotations

import numpy as np
import pytest
import trimesh

from nrdf.geometry.simplify import simplified, split_at_edges

BALL = trimesh.creation.icosphere(5, 0.5)
"""20,480 triangles."""


@pytest.mark.parametrize("most", [200, 5000])
def test_few_enough_triangles_are_left_and_they_are_still_the_ball(most):
    vertices, faces = simplified(np.array(BALL.vertices), np.array(BALL.faces), most)
    assert most / 3 < len(faces) <= most
    made = trimesh.Trimesh(vertices, faces, process=False)
    assert np.abs(np.linalg.norm(vertices, axis=1) - 0.5).max() < 1e-6  # none is invented
    assert made.volume == pytest.approx(BALL.volume, rel=0.1 if most < 1000 else 0.01)


def test_a_mesh_with_few_triangles_stays_as_it_is():
    vertices, faces = np.array(BALL.vertices), np.array(BALL.faces)
    same = simplified(vertices, faces, len(faces))
    assert same[0] is vertices and same[1] is faces


def test_vertices_are_apart_at_sharp_edges_alone():
    cube = trimesh.creation.box()
    vertices, faces = split_at_edges(np.array(cube.vertices), np.array(cube.faces))
    assert len(vertices) == 24 and len(faces) == 12
    np.testing.assert_array_equal(vertices[faces], cube.vertices[cube.faces])
    vertices, faces = split_at_edges(np.array(BALL.vertices), np.array(BALL.faces))
    assert len(vertices) == len(BALL.vertices)
