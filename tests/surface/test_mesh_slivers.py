"""Triangles that are nearly lines are taken out."""

import numpy as np
import pytest

from nrdf.surface.mesh_slivers import without_slivers


def test_a_flat_triangle_gives_its_third_corner_to_its_neighbour():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0.4, 1e-7, 0], [0.5, 1.0, 0], [0.4, -1.0, 0]])
    faces = np.array([[0, 1, 2], [0, 2, 3], [2, 1, 3], [1, 0, 4]])
    _, found, origin = without_slivers(vertices, faces, np.arange(4))
    a, b, c = (vertices[corner] for corner in found.T)
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2.0
    assert len(found) == 4 and areas.min() > 0.1
    assert areas.sum() == pytest.approx(1.0)
    assert sorted(origin) == [1, 2, 3, 3]


def test_the_ends_of_a_short_edge_become_one():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 1e-8, 0], [0, 1, 0], [1, 1, 0.0]])
    faces = np.array([[0, 1, 2], [0, 2, 3], [2, 4, 3]])
    _, found, origin = without_slivers(vertices, faces, np.arange(3))
    assert len(found) == 2 and origin.tolist() == [1, 2]


def test_sound_triangles_stay():
    vertices, faces = np.eye(3), np.array([[0, 1, 2]])
    assert without_slivers(vertices, faces, np.array([7]))[1] is faces
