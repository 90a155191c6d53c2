"""How faces hang together."""

import numpy as np
import trimesh

from nrdf.surface.mesh_edges import boundary_loops, edge_components, opposite_half_edges


def test_a_closed_mesh_has_no_border_and_one_part():
    faces = np.asarray(trimesh.creation.icosphere(1).faces)
    assert boundary_loops(faces) == []
    assert edge_components(faces).max() == 0
    opposite = opposite_half_edges(faces)
    assert np.array_equal(opposite[opposite], np.arange(len(opposite)))


def test_faces_of_different_kinds_are_different_parts():
    faces = np.asarray(trimesh.creation.box().faces)
    normals = trimesh.creation.box().face_normals
    assert edge_components(faces, normals[:, 2] > 0.5).max() == 1
    sides = edge_components(faces, np.abs(normals).argmax(axis=1))
    assert sides.max() == 5


def test_loops_that_meet_in_a_corner_stay_apart():
    faces = np.array([[0, 1, 2], [0, 3, 4]])
    loops = boundary_loops(faces)
    assert sorted(sorted(loop.tolist()) for loop in loops) == [[0, 1, 2], [0, 3, 4]]


def test_a_third_face_at_an_edge_is_a_border():
    faces = np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]])
    assert (opposite_half_edges(faces) < 0).all()
