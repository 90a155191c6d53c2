"""Nearest neighbours in position and normal, against all distances."""

from __future__ import annotations

import numpy as np
import pytest

from builders.encoded import as_encoded
from builders.solids import box
from nrdf.regions.association import alike_voters, nearest_voters, snap
from nrdf.regions.mapping import MappedPoints


@pytest.fixture(scope="module")
def clouds():
    mapped, mapped_normals = box((1.0, 0.6, 0.4), 150)
    target, target_normals = box((0.9, 0.7, 0.4), 220, seed=1)
    return mapped, mapped_normals, target, target_normals


def all_distances(mapped, mapped_normals, target, target_normals, weight):
    """(m, n)"""
    place = ((mapped[:, None] - target) ** 2).sum(-1)
    turn = ((mapped_normals[:, None] - target_normals) ** 2).sum(-1)
    return np.sqrt(place + weight**2 * turn)


@pytest.mark.parametrize("weight", [0.0, 0.1, 1.0])
def test_snap_is_the_nearest_target_point(clouds, weight):
    index, distance = snap(*clouds, weight)
    expected = all_distances(*clouds, weight)
    assert index.shape == distance.shape == (150,)
    np.testing.assert_allclose(distance, expected.min(1), atol=1e-12)
    np.testing.assert_allclose(expected[np.arange(150), index], expected.min(1), atol=1e-12)


@pytest.mark.parametrize(("weight", "count"), [(0.1, 7), (0.5, 1), (0.0, 3)])
def test_voters_are_the_nearest_mapped_points(clouds, weight, count):
    index, distance = nearest_voters(*clouds, weight, count)
    assert index.shape == distance.shape == (220, count)
    expected = np.sort(all_distances(*clouds, weight).T, axis=1)[:, :count]
    np.testing.assert_allclose(distance, expected, atol=1e-12)
    own = all_distances(*clouds, weight).T[np.arange(220)[:, None], index]
    np.testing.assert_allclose(own, expected, atol=1e-12)


def test_no_more_voters_than_there_are(clouds):
    mapped, mapped_normals, target, target_normals = clouds
    index, distance = nearest_voters(mapped[:4], mapped_normals[:4], target, target_normals, 0.1, 7)
    assert index.shape == (220, 4) and np.isfinite(distance).all()
    assert (np.sort(index, axis=1) == np.arange(4)).all()


def test_normals_tell_the_two_sides_of_a_thin_plate_apart():
    plate, normals = box((1.0, 0.01, 1.0), 1500)
    # Its lower side is nearly where the plate's upper side is.
    other, other_normals = box((1.0, 0.01, 1.0), 1500, seed=1, centre=(0.0, 0.008, 0.0))
    faces, other_faces = np.abs(normals[:, 1]) > 0.5, np.abs(other_normals[:, 1]) > 0.5

    def agreement(weight):
        index, _ = snap(plate, normals, other, other_normals, weight)
        asked, _ = nearest_voters(plate, normals, other, other_normals, weight, 5)
        snapped = (other_normals[index] == normals).all(1)[faces]
        voted = (normals[asked] == other_normals[:, None]).all(2)[other_faces]
        return snapped.mean(), voted.mean()

    assert min(agreement(0.1)) > 0.98
    assert max(agreement(0.0)) < 0.8


@pytest.fixture(scope="module")
def leg_and_rail():
    """A reference of a leg that stands (1500 points) and a rail that lies (1500)."""
    leg, leg_normals = box((0.04, 0.5, 0.04), 1500)
    rail, rail_normals = box((0.04, 0.04, 0.5), 1500, seed=1, centre=(0.4, 0.0, 0.0))
    return as_encoded(np.concatenate([leg, rail]), np.concatenate([leg_normals, rail_normals]))


@pytest.fixture(scope="module")
def leg():
    return as_encoded(*box((0.04, 0.5, 0.04), 1200, seed=2))


def arrived(reference, error):
    """The rail where the target's leg is, the leg beside it."""
    count = len(reference.points)
    moved = reference.points - np.where(np.arange(count) < 1500, 0.08, 0.4)[:, None] * [1, 0, 0]
    expected = np.full(count, error)
    return MappedPoints(moved, reference.normals, np.ones(count), expected, np.zeros((count, 3)))


def share_of_leg(index, target):
    """Of the votes where leg and rail cross, on the sides that both have."""
    crossing = (np.abs(target.points[:, 1]) < 0.02) & (np.abs(target.normals[:, 0]) > 0.5)
    return (index[crossing] < 1500).mean()


def test_a_leg_is_voted_for_by_a_leg(leg_and_rail, leg):
    mapped = arrived(leg_and_rail, 0.05)
    nearest, _ = nearest_voters(mapped.points, mapped.normals, leg.points, leg.normals)
    alike, _ = alike_voters(mapped, leg_and_rail, leg)
    assert share_of_leg(nearest, leg) < 0.05
    assert share_of_leg(alike, leg) > 0.8


def test_where_the_map_is_exact_places_decide(leg_and_rail, leg):
    index, _ = alike_voters(arrived(leg_and_rail, 0.001), leg_and_rail, leg)
    assert share_of_leg(index, leg) < 0.05


def test_where_no_error_is_predicted_local_shapes_count(leg_and_rail, leg):
    index, _ = alike_voters(arrived(leg_and_rail, 0.0), leg_and_rail, leg)
    expected, _ = alike_voters(arrived(leg_and_rail, 0.025), leg_and_rail, leg)
    np.testing.assert_array_equal(index, expected)


def test_distances_of_alike_voters_are_in_position_and_normal(leg_and_rail, leg):
    mapped = arrived(leg_and_rail, 0.05)
    index, distance = alike_voters(mapped, leg_and_rail, leg)
    assert index.shape == distance.shape == (1200, 7)
    clouds = mapped.points, mapped.normals, leg.points, leg.normals
    expected = all_distances(*clouds, 0.1).T[np.arange(1200)[:, None], index]
    np.testing.assert_allclose(distance, expected, atol=1e-12)


def test_no_more_alike_voters_than_there_are(leg):
    few = as_encoded(*box((0.2, 0.2, 0.2), 4))
    index, _ = alike_voters(arrived(few, 0.05), few, leg)
    assert (np.sort(index, axis=1) == np.arange(4)).all()
