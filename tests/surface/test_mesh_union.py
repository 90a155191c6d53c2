"""Overlapping parts as one surface."""

import numpy as np
import pytest
import trimesh

from nrdf.surface.mesh_union import united


def box(size, at=(0.0, 0.0, 0.0)) -> trimesh.Trimesh:
    return trimesh.creation.box(size, trimesh.transformations.translation_matrix(at))


def parts(*meshes: trimesh.Trimesh) -> tuple[np.ndarray, np.ndarray]:
    both = trimesh.util.concatenate(meshes)
    return np.asarray(both.vertices), np.asarray(both.faces)


SEAT = box((1.0, 1.0, 0.1))
LEG = box((0.1, 0.1, 1.0), (0.013, 0.0, -0.5))


def test_parts_are_cut_exactly_where_they_cross_and_become_one():
    vertices, faces = parts(SEAT, LEG)
    found = united(vertices, faces)
    shape = trimesh.Trimesh(found.vertices, found.faces, process=False)
    assert shape.is_watertight and shape.body_count == 1
    assert shape.volume == pytest.approx(0.1 + 0.01 * 0.95)
    assert shape.area == pytest.approx(2.0 + 0.4 - 0.01 + 0.4 * 0.95 + 0.01)
    assert found.parts == 2
    assert found.covered == pytest.approx(0.4 * 0.05 + 0.02)
    # Every piece lies in the face that it is of.
    normals = trimesh.Trimesh(vertices, faces, process=False).face_normals[found.origin]
    assert shape.face_normals == pytest.approx(normals, abs=1e-9)


def test_boxes_that_share_an_edge_of_their_own_vertices_stay_two():
    one, other = box((1, 1, 1)), box((1, 1, 1), (1.0, 1.0, 0.0))
    vertices, faces = parts(one, other, box((0.2, 0.2, 3.0)))
    vertices, inverse = np.unique(np.round(vertices, 9), axis=0, return_inverse=True)
    found = united(vertices, inverse.reshape(-1)[faces])
    shape = trimesh.Trimesh(found.vertices, found.faces, process=False)
    assert shape.volume == pytest.approx(2.0 + 0.04 * 2.0)


def test_an_open_part_is_cut_by_a_closed_one_and_covers_nothing():
    sheet = trimesh.Trimesh(
        [[-2, -2, 0], [2, -2, 0], [2, 2, 0], [-2, 2, 0]], [[0, 1, 2], [0, 2, 3]]
    )
    found = united(*parts(sheet, box((1, 1, 1))))
    shape = trimesh.Trimesh(found.vertices, found.faces, process=False)
    assert shape.area == pytest.approx(16.0 - 1.0 + 6.0, rel=1e-4)


def test_a_leg_without_its_ends_and_with_a_crack_is_closed_for_the_cut():
    leg = LEG.copy()
    leg.update_faces(np.abs(leg.face_normals[:, 2]) < 0.5)
    corners = np.asarray(leg.vertices)[leg.faces].reshape(-1, 3)
    corners += 1e-6 * np.random.default_rng(0).normal(size=corners.shape)
    loose = trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=False)
    found = united(*parts(SEAT, loose))
    area = trimesh.Trimesh(found.vertices, found.faces, process=False).area
    assert area == pytest.approx(2.0 + 0.4 - 0.01 + 0.4 * 0.95, rel=1e-4)


def test_a_single_part_is_left_as_it_is():
    vertices, faces = parts(SEAT)
    found = united(vertices, faces)
    assert found.faces is faces and found.covered == 0.0


def test_what_is_seen_through_an_open_side_stays():
    crate = box((1.0, 1.0, 1.0))
    crate.update_faces(crate.face_normals[:, 2] < 0.5)  # the missing lid is a fifth of its area
    vertices, faces = parts(crate, box((0.4, 0.4, 0.4)), box((0.2, 0.2, 2.0), (0.35, 0.35, 0.0)))
    found = united(vertices, faces)
    inner = (np.abs(found.vertices[found.faces]) < 0.2 + 1e-9).all(axis=(1, 2))
    assert trimesh.Trimesh(found.vertices, found.faces[inner]).area == pytest.approx(6 * 0.16)
