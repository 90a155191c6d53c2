"""Meshes as they come, made fit for planning or refused."""

import numpy as np
import pytest
import trimesh

from nrdf.errors import DataError
from nrdf.surface.mesh_repair import hidden_faces, repaired_skin


def test_what_does_no_harm_is_repaired_and_said():
    box = trimesh.creation.box((1, 1, 1))
    faces = np.concatenate([box.faces[:6], box.faces[6:, ::-1], box.faces[:2], [[3, 3, 4]]])
    vertices, skin, repairs = repaired_skin(np.asarray(box.vertices), faces)
    assert len(skin) == 12 and trimesh.Trimesh(vertices, skin).is_watertight
    assert trimesh.Trimesh(vertices, skin).volume == pytest.approx(1.0)
    assert repairs == ("3 faces without area or given twice removed", "6 faces turned outwards")


def test_edges_of_more_than_two_faces_are_split():
    box, fin = trimesh.creation.box((1, 1, 1)), np.array([[0.5, 0.5, -0.5], [0.5, 0.5, 0.5]])
    vertices = np.concatenate([box.vertices, fin, [[1.0, 1.0, 0.0]]])
    faces = np.concatenate([box.faces, [[8, 9, 10]]])
    vertices, skin, _ = repaired_skin(vertices, faces)
    shape = trimesh.Trimesh(vertices, skin, process=False)
    assert shape.area == pytest.approx(6.0 + np.sqrt(0.5) / 2.0)
    assert np.bincount(shape.edges_unique_inverse).max() == 2


def test_the_covered_ends_of_parts_that_overlap_are_hidden():
    seat = trimesh.creation.box((1, 1, 0.1))
    leg = trimesh.creation.box(
        (0.1, 0.1, 1), trimesh.transformations.translation_matrix([0, 0, -0.5])
    )
    both = trimesh.util.concatenate([seat, leg])
    hidden = hidden_faces(np.asarray(both.vertices), np.asarray(both.faces))
    assert hidden.sum() == 2 and both.face_normals[hidden][:, 2].min() > 0.9


def test_loose_triangles_are_no_surface():
    vertices = np.random.default_rng(0).random((60_000, 3))
    with pytest.raises(DataError, match="20000 of its 20000 triangles are loose"):
        repaired_skin(vertices, np.arange(60_000).reshape(-1, 3))


def test_triangles_that_nearly_touch_are_sewn_together():
    sphere = trimesh.creation.icosphere(2)
    corners = np.asarray(sphere.vertices)[sphere.faces].reshape(-1, 3)
    corners += 1e-7 * np.random.default_rng(0).normal(size=corners.shape)
    vertices, skin, repairs = repaired_skin(corners, np.arange(len(corners)).reshape(-1, 3))
    assert trimesh.Trimesh(vertices, skin, process=False).is_watertight
    assert repairs == ("320 faces that touched no other sewn to their neighbours",)


def test_random_triangles_are_refused_at_once():
    rng = np.random.default_rng(0)
    faces = np.array([rng.choice(50, 3, replace=False) for _ in range(5000)])
    with pytest.raises(DataError, match=r"a straight line through it meets .* no surface"):
        repaired_skin(rng.random((50, 3)), faces)


def tube(way: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of a closed tube around a way (n, 3), 0.2 wide."""
    along = np.gradient(way, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    across = np.cross(along, [0.0, 0.0, 1.0])
    ring = [across, np.cross(along, across), -across, -np.cross(along, across)]
    vertices = np.stack([way + 0.1 * side for side in ring], axis=1).reshape(-1, 3)
    one = np.array([(k, (k + 1) % 4, k + 4, (k + 1) % 4 + 4) for k in range(4)])
    sides = one[:, [[0, 1, 2], [1, 3, 2]]].reshape(-1, 3)
    steps = 4 * np.arange(len(way) - 1)[:, None, None]
    last = len(vertices)
    ends = np.array(
        [[1, 0, 2], [2, 0, 3], [last - 4, last - 3, last - 2], [last - 4, last - 2, last - 1]]
    )
    return vertices, np.concatenate([(sides + steps).reshape(-1, 3), ends])


@pytest.mark.parametrize(("height", "crossing"), [(0.0, True), (0.4, False)])
def test_a_part_that_crosses_itself_is_said(height, crossing):
    """A tube in the form of an eight, in one part, flat or with one bow above the other."""
    turn = np.linspace(-0.5, 1.6 * np.pi, 80)
    way = np.stack([np.sin(turn), 0.5 * np.sin(2.0 * turn), height * np.cos(turn)], axis=1)
    said = repaired_skin(*tube(way))[2]
    assert any("crosses itself" in line for line in said) == crossing
