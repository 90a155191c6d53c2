"""Parts of a mesh made closed."""

import numpy as np
import pytest
import trimesh

from nrdf.surface.fine_mesh import edges_of
from nrdf.surface.mesh_sewing import (
    capped,
    crowded_edges_divided,
    each_once,
    paired_half_edges,
    part_numbers,
    sewn_borders,
    sheets_apart,
    split_vertices,
    thickened,
)


def two_boxes_on_an_edge() -> tuple[np.ndarray, np.ndarray]:
    """Two cubes that share the vertices of one edge."""
    one = trimesh.creation.box((1, 1, 1))
    both = trimesh.util.concatenate([one, one.copy().apply_translation([1, 1, 0])])
    vertices, number = np.unique(both.vertices, axis=0, return_inverse=True)
    return vertices, number.reshape(-1)[both.faces]


def test_four_faces_at_an_edge_are_two_parts_of_their_own():
    vertices, faces, source = crowded_edges_divided(*two_boxes_on_an_edge())
    assert len(faces) == 28 and np.bincount(source).max() == 2
    opposite = paired_half_edges(vertices, faces)
    assert (opposite >= 0).all()
    part = part_numbers(opposite)
    split, place = split_vertices(faces, opposite)
    for number in (0, 1):
        body = trimesh.Trimesh(vertices[place], split[part == number], process=False)
        assert body.is_watertight and body.volume == pytest.approx(1.0)


def test_a_crack_with_a_vertex_on_one_side_only_is_sewn():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [1, -1, 0], [0.5, 0, 4e-6]])
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 4, 5], [5, 4, 1]])
    _, sewn, source = sewn_borders(vertices, faces)
    assert len(sewn) == 5 and source.tolist() == [0, 1, 2, 3, 0]
    assert (paired_half_edges(vertices, sewn) < 0).sum() == 5


def test_small_holes_are_capped_and_large_ones_are_not():
    tube = trimesh.creation.cylinder(0.1, 1.0, sections=12)
    tube.update_faces(np.abs(tube.face_normals[:, 2]) < 0.5)
    tube.merge_vertices()
    closed = capped(np.asarray(tube.vertices), np.asarray(tube.faces), 0.25)
    assert closed is not None
    shape = trimesh.Trimesh(*closed, process=False)
    assert shape.is_watertight and shape.volume > 0.0
    assert capped(np.asarray(tube.vertices), np.asarray(tube.faces), 0.01) is None


def test_a_sheet_gets_a_back():
    sheet = (
        np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1.0, 0]]),
        np.array([[0, 1, 2], [0, 2, 3]]),
    )
    body = trimesh.Trimesh(*thickened(*sheet, 0.01), process=False)
    assert body.is_watertight and body.volume == pytest.approx(0.01)


def test_what_is_given_twice_is_left_once_and_back_to_back_is_not_twice():
    faces = np.array([[0, 1, 2], [1, 2, 0], [2, 1, 0]])
    assert each_once(faces).tolist() == [0, 2]


def test_two_sheets_back_to_back_have_no_face_and_no_crowded_edge_in_common():
    x, y = np.meshgrid(np.arange(3.0), np.arange(3.0))
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(9)], axis=1)
    quads = np.array([[i, i + 1, i + 4, i + 3] for i in (0, 1, 3, 4)])
    front = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    apart, faces = sheets_apart(vertices, np.concatenate([front, front[:, ::-1]]))
    _, count = np.unique(np.sort(faces, axis=1), axis=0, return_counts=True)
    assert (count == 1).all()
    _, of_face = edges_of(faces)
    assert np.bincount(of_face.ravel()).max() == 2
    corners = apart[faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.abs(cross[:, 2]).sum() / 2.0 == 8.0 and cross[:, 2].sum() == 0.0
