"""Triangles that hang together, and those that do not."""

import numpy as np
import pytest
import trimesh

from nrdf.errors import DataError
from nrdf.geometry.loose_triangles import check_surface, count_loose


def corners_of(mesh: trimesh.Trimesh) -> tuple[np.ndarray, np.ndarray]:
    """Each triangle with corners of its own, as an STL file has them."""
    corners = np.asarray(mesh.vertices)[mesh.faces].reshape(-1, 3)
    return corners, np.arange(len(corners)).reshape(-1, 3)


def test_pieces_of_few_faces_are_counted():
    two, lone = [[0, 1, 2], [2, 1, 3]], [[4, 5, 6]]
    ring = [[7, 8 + k, 8 + (k + 1) % 5] for k in range(5)]
    faces = np.array(two + lone + ring)
    assert [count_loose(faces, few) for few in (1, 2, 4, 5)] == [1, 3, 3, 8]
    assert count_loose(np.array(ring)) == 0


@pytest.mark.parametrize("size", [1, 2, 4])
def test_many_loose_pieces_are_no_surface(size):
    rng = np.random.default_rng(0)
    fan = np.array([[0, k, k + 1] for k in range(1, size + 1)])
    faces = (fan + (size + 2) * np.arange(3000)[:, None, None]).reshape(-1, 3)
    vertices = 0.01 * rng.normal(size=(3000, size + 2, 3)) + rng.random((3000, 1, 3))
    said = f"{len(faces)} of its {len(faces)} triangles are loose"
    with pytest.raises(DataError, match=said):
        check_surface(vertices.reshape(-1, 3), faces)


def test_few_of_them_or_fewer_than_half_are_let_through():
    vertices, faces = corners_of(trimesh.creation.icosphere(4))
    rng = np.random.default_rng(0)
    check_surface(rng.random((3 * 1500, 3)), np.arange(3 * 1500).reshape(-1, 3))
    sphere = trimesh.creation.icosphere(4)
    apart = sphere.faces.max() + 1 + faces[: len(faces) // 2]
    both = np.concatenate([sphere.vertices, vertices + rng.random(vertices.shape)])
    check_surface(both, np.concatenate([sphere.faces, apart]))


@pytest.mark.parametrize("noise", [0.0, 1e-7, 5e-7])
def test_triangles_whose_corners_nearly_meet_are_a_surface(noise):
    vertices, faces = corners_of(trimesh.creation.icosphere(4))
    vertices += noise * np.random.default_rng(0).normal(size=vertices.shape)
    check_surface(vertices, faces)
    with pytest.raises(DataError, match="are loose"):
        check_surface(vertices + 1e-3 * np.random.default_rng(1).random(vertices.shape), faces)


def test_triangles_across_everything_are_no_surface():
    rng = np.random.default_rng(0)
    with pytest.raises(DataError, match=r"a straight line through it meets .* no surface"):
        check_surface(rng.random((50, 3)), rng.integers(0, 50, (5000, 3)))
