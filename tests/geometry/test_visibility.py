"""Which points are seen, and from which side."""

from __future__ import annotations

import numpy as np

from builders.oriented_clouds import box, sphere
from nrdf.geometry.visibility import seen_from, seen_from_both_sides, visibility


def test_visibility_tells_the_outer_side_and_finds_buried_points():
    rng = np.random.default_rng(0)
    outer, outer_normals = sphere(rng, 6000)
    inner, inner_normals = sphere(rng, 1000, radius=0.3)
    points = np.concatenate([outer, inner])
    given_normals = np.concatenate([outer_normals, inner_normals])
    given_normals[:6000:3] *= -1
    vote, front, back = visibility(points, given_normals)
    outward = (given_normals * points).sum(axis=1) > 0
    assert ((vote > 0) == outward)[:6000].all()
    seen, unseen = np.where(outward, front, back), np.where(outward, back, front)
    assert (seen[:6000] >= 10).mean() > 0.999
    assert unseen[:6000].mean() < 1.0
    assert (np.maximum(front, back)[6000:] < 3).mean() > 0.95


def test_both_sides_are_seen_of_an_open_surface_only():
    rng = np.random.default_rng(0)
    points, normals = box(rng, 6000, (1.0, 0.05, 0.8))
    assert not seen_from_both_sides(points, normals).any()
    bowl, lines = sphere(rng, 6000)
    dish = bowl[:, 1] < -0.3
    assert seen_from_both_sides(bowl[dish], lines[dish]).mean() > 0.8
    flask = bowl[:, 1] < 0.4  # a small hole changes nothing
    assert not seen_from_both_sides(bowl[flask], lines[flask]).any()


def test_points_are_seen_from_the_side_that_they_face():
    points, normals = box(np.random.default_rng(0), 4000, (1.0, 1.0, 1.0))
    above, below = seen_from(points, normals, np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]))
    inner = (np.abs(points[:, [0, 2]]) < 0.42).all(axis=1)  # the sides are in the edges' pixels
    np.testing.assert_array_equal(above[inner], normals[inner, 1] > 0)
    np.testing.assert_array_equal(below[inner], normals[inner, 1] < 0)


def test_what_lies_before_a_point_hides_it():
    points, normals = box(np.random.default_rng(0), 4000, (1.0, 0.1, 1.0))
    lid = points * [0.5, 1.0, 0.5] + [0.0, 0.5, 0.0]
    both, lines = np.concatenate([points, lid]), np.concatenate([normals, normals])
    seen = seen_from(both, lines, np.array([[0.0, 1.0, 0.0]]))[0, : len(points)]
    covered = (np.abs(points[:, [0, 2]]) < 0.22).all(axis=1) & (normals[:, 1] > 0)
    free = (np.abs(points[:, [0, 2]]) > 0.28).any(axis=1) & (normals[:, 1] > 0)
    assert not seen[covered].any()
    assert seen[free].mean() > 0.88
