"""Ends of a scan's mesh: gaps amid the surface stay closed, what lies past the points goes."""

import numpy as np

from nrdf.surface.mesh_edges import boundary_loops, opposite_half_edges
from nrdf.surface.scan_ends import closed, end_edges, even_ends, trimmed


def sheet(count: int = 21) -> tuple[np.ndarray, np.ndarray]:
    """A square in z = 0 of (count - 1)² squares of side 1, two triangles each."""
    x, y = np.meshgrid(np.arange(count), np.arange(count), indexing="ij")
    vertices = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3).astype(float)
    a = (np.arange(count - 1)[:, None] * count + np.arange(count - 1)).reshape(-1)
    first = np.stack([a, a + count, a + count + 1], axis=1)
    second = np.stack([a, a + count + 1, a + 1], axis=1)
    return vertices, np.concatenate([first, second])


def test_what_lies_past_the_last_points_goes_and_a_gap_between_points_stays():
    vertices, faces = sheet()
    past = np.maximum(vertices[:, 0] - 14.0, 0.0)  # no points beyond x = 14
    past[np.linalg.norm(vertices[:, :2] - [6.0, 10.0], axis=1) < 2.0] = 1.5
    all_out, area = np.ones(len(faces), bool), np.full(len(faces), 0.5)
    kept = trimmed(faces, all_out, past, area)
    assert vertices[kept][..., 0].max() == 14.0
    assert len(boundary_loops(kept)) == 1


def test_small_folds_make_no_end_and_large_ones_do():
    vertices, faces = sheet()
    middle = vertices[faces].mean(axis=1)[:, :2]
    past, area = np.zeros(len(vertices)), np.full(len(faces), 0.5)
    for place, half, more in ((5.5, 0.5, 0), (14.5, 2.5, 1)):
        fold = np.abs(middle - place).max(axis=1) < half
        past[:] = 0.8 * (np.abs(vertices[:, :2] - place).max(axis=1) < half + 0.1)
        kept = trimmed(faces, ~fold, past, area)
        assert (len(kept) < len(faces) - fold.sum()) == more


def test_holes_no_larger_than_a_gap_are_closed():
    vertices, faces = sheet()
    middle = vertices[faces].mean(axis=1)[:, :2]
    small = np.abs(middle - [5.5, 5.5]).max(axis=1) < 0.5
    large = np.abs(middle - [14.5, 14.5]).max(axis=1) < 2.0
    triangle = np.arange(len(faces)) == 170
    given = faces[~(small | large | triangle)]
    found, whole = closed(vertices, given, np.full(len(vertices), 1.0))
    assert len(boundary_loops(whole)) == 2  # the sheet's own end, and the large hole
    a, b, c = (found[corner] for corner in whole.T)
    up = np.cross(b - a, c - a)[:, 2]
    assert (up > 0.0).all() and np.isclose(up.sum(), len(faces) - large.sum())


def test_ends_are_even_and_near_the_last_points():
    vertices, faces = sheet()
    rough = vertices.copy()
    rough[vertices[:, 0] == 20.0, 0] += np.resize([0.4, -0.4], 21)
    points = vertices.copy()
    points[:, 0] = np.minimum(points[:, 0], 19.0)
    normals = np.tile([0.0, 0.0, 1.0], (len(vertices), 1))
    found = even_ends(rough, faces, points, normals, np.full(len(vertices), 2.0))
    end = np.flatnonzero((vertices[:, 0] == 20.0) & (np.abs(vertices[:, 1] - 10.0) < 7.0))
    np.testing.assert_allclose(found[end, 0], 19.0 + 0.2 * 2.0, atol=0.05)
    inner = np.flatnonzero((vertices > 0.0).all(axis=1) & (vertices[:, :2] < 20.0).all(axis=1))
    np.testing.assert_array_equal(found[inner], rough[inner])


def test_end_edges_are_those_of_one_face():
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    assert sorted(map(tuple, end_edges(faces).tolist())) == [(0, 1), (1, 2), (2, 3), (3, 0)]
    assert (opposite_half_edges(faces) >= 0).sum() == 2
