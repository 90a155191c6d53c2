"""Triangles without area taken out of a mesh."""

import numpy as np
import pytest
import trimesh

from nrdf.surface.mesh_edges import opposite_half_edges
from nrdf.surface.mesh_needles import without_needles

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0, 0]], float)


def area(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    return trimesh.Trimesh(vertices, faces, process=False).area_faces


def test_lines_within_a_closed_mesh_go_and_it_stays_closed():
    shape = trimesh.creation.box((1.0, 1.0, 1.0)).subdivide().subdivide()
    # A face's middle is moved onto its edge, which makes a line of a triangle.
    middle, faces = shape.triangles[7].mean(axis=0), shape.faces
    a, b, c = faces[7]
    new = len(shape.vertices)
    faces = np.concatenate([np.delete(faces, 7, 0), [[a, b, new], [b, c, new], [c, a, new]]])
    on_edge = (shape.vertices[a] + shape.vertices[b]) / 2.0
    vertices = np.concatenate([shape.vertices, [on_edge]])
    assert (area(vertices, faces) < 1e-12).sum() == 1 and not np.allclose(middle, on_edge)
    found, source, cracks = without_needles(vertices, faces)
    assert not cracks.any() and len(source) == len(found)
    assert area(vertices, found).min() > 1e-6
    assert area(vertices, found).sum() == pytest.approx(6.0)
    assert (opposite_half_edges(found) >= 0).all()


def test_a_sheet_that_is_flat_nowhere_is_left_as_it_is():
    faces = np.array([[0, 4, 3], [4, 1, 2], [4, 2, 3]])
    found, source, cracks = without_needles(SQUARE, faces)
    assert (found == faces).all() and (source == np.arange(3)).all() and not cracks.any()


def test_a_line_with_nothing_beside_it_is_removed():
    faces = np.array([[0, 4, 1], [1, 2, 3]])
    found, source, _ = without_needles(SQUARE, faces)
    assert source.tolist() == [1] and (found == faces[1]).all()
