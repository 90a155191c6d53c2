"""Which unexplained parts join a region."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.regions.patches import explained_by, find_patches


def grid(x, y, z=0.0, step=0.02):
    """Points of a sheet over the intervals x and y, (n, 3)."""
    u, v = np.meshgrid(np.arange(*x, step), np.arange(*y, step))
    return np.stack([u.ravel(), v.ravel(), np.full(u.size, z)], axis=1)


@pytest.fixture(scope="module")
def sheet():
    """A sheet whose left half is the region, with three unexplained parts that voted for it: a flap
    at the region's edge, a flap at the other half's, and an island."""
    parts = [
        grid((0, 1), (0, 1)),
        grid((0.1, 0.3), (-0.2, 0)),
        grid((0.7, 0.9), (-0.2, 0)),
        grid((0.1, 0.3), (0.3, 0.5), z=0.3),
    ]
    points = np.concatenate(parts)
    part = np.repeat(np.arange(4), [len(p) for p in parts])
    voted = (part > 0) | (points[:, 0] < 0.5)
    return points, part, voted


def test_a_part_joins_the_region_that_it_grows_out_of(sheet):
    points, part, voted = sheet
    found = find_patches(points, part == 0).joined(voted)
    assert found[part == 0].tolist() == voted[part == 0].tolist()
    assert found[part == 1].all()
    assert not found[part == 2].any() and not found[part == 3].any()


def test_what_did_not_vote_for_the_region_does_not_join(sheet):
    points, part, voted = sheet
    voted = voted & (part != 1)
    assert not find_patches(points, part == 0).joined(voted)[part == 1].any()


def test_a_part_larger_than_the_region_does_not_join(sheet):
    points, part, voted = sheet
    small = voted & ((part == 1) | ((points[:, 1] < 0.02) & (part == 0)))
    assert (small & (part == 0)).sum() < (part == 1).sum()
    assert not find_patches(points, part == 0).joined(small)[part == 1].any()


def test_where_all_is_explained_the_vote_stands(sheet):
    points, _, voted = sheet
    explained = np.ones(len(points), bool)
    np.testing.assert_array_equal(find_patches(points, explained).joined(voted), voted)


def test_where_nothing_is_explained_nothing_is_found(sheet):
    points, _, voted = sheet
    assert not find_patches(points, np.zeros(len(points), bool)).joined(voted).any()


def test_a_point_far_from_what_it_asked_is_explained_only_by_a_doubtful_field():
    distance = np.array([[0.01, 0.02], [0.1, 0.12], [0.1, 0.12]])
    error = np.array([[0.01, 0.01], [0.02, 0.02], [0.07, 0.08]])
    assert explained_by(distance, error).tolist() == [True, False, True]
    assert explained_by(distance, np.zeros((3, 2))).all()  # it expects no error: it does not say
