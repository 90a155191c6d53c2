"""Registration against exact truth: deformed members of families, thin plates, missing parts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from builders.solids import box
from nrdf.geometry.canonical import canonical_transform
from nrdf.shapes import registration
from nrdf.shapes.families import get_family
from nrdf.shapes.registration import RegistrationSettings, RegistrationTemplate

SETTINGS = RegistrationSettings(iterations=10)


def test_radii_and_weights_fall_from_start_to_end():
    settings = RegistrationSettings(iterations=5)
    for values, ends in (
        (settings.radii(), (0.25, 0.09)),
        (settings.normal_weights(), (0.3, 0.1)),
    ):
        assert values.shape == (5,) and (np.diff(values) < 0).all()
        np.testing.assert_allclose(values[[0, -1]], ends)


def translated(points):
    return points + np.array([0.05, -0.03, 0.04])


def stretched(points):
    return points * [0.8, 1.15, 0.9]


def bent(points):
    out = points.copy()
    out[:, 0] += 0.5 * points[:, 1] ** 2
    out[:, 1] += 0.8 * points[:, 0] ** 2
    out[:, 2] *= 1 + 0.2 * points[:, 0]
    return out


@pytest.mark.parametrize("deform", [translated, stretched, bent])
@pytest.mark.parametrize(("family", "seed"), [("chair", 0), ("plane", 3)])
def test_a_deformed_member_is_matched_to_itself(family, seed, deform):
    member = get_family(family).member(seed)
    template = member.sample_surface(700, np.random.default_rng(0))
    target = member.sample_surface(1500, np.random.default_rng(1))
    normals = deformed_normals(deform, target.points, target.normals)
    found = RegistrationTemplate(template.points, template.normals, SETTINGS).register(
        deform(target.points), normals
    )
    truth = deform(template.points)
    assert found.points.shape == (700, 3) and found.points.dtype == np.float32
    error = np.linalg.norm(found.points - truth, axis=1)
    nothing = np.linalg.norm(template.points - truth, axis=1)
    assert error.mean() < 0.035 and error.mean() < 0.45 * nothing.mean()
    nearest = np.linalg.norm(deform(target.points)[found.target_index] - truth, axis=1)
    assert np.median(nearest) < 0.04  # the target's points are 0.02 apart


def deformed_normals(deform, points, normals):
    """Normals of the deformed surface, from two deformed tangents each."""
    helper = np.where(np.abs(normals[:, :1]) < 0.7, [[1.0, 0, 0]], [[0, 1.0, 0]])
    first = np.cross(normals, helper)
    second = np.cross(normals, first)
    step = 1e-5
    tangents = [(deform(points + step * t) - deform(points - step * t)) for t in (first, second)]
    turned = np.cross(*tangents)
    return turned / np.linalg.norm(turned, axis=1, keepdims=True)


def test_front_and_back_of_a_thin_plate_are_not_confused():
    size = (1.0, 0.8, 0.02)
    points, normals = box(size, 500)
    target, target_normals = box(size, 1200, seed=1, centre=(0.0, 0.0, 0.018))
    faces = np.abs(normals[:, 2]) > 0.5

    def right(settings):
        found = RegistrationTemplate(points, normals, settings).register(target, target_normals)
        return (target_normals[found.target_index] == normals).all(axis=1)[faces].mean()

    assert right(SETTINGS) > 0.99
    blind = replace(SETTINGS, normal_weight_start=1e-6, normal_weight_end=1e-6)
    assert right(blind) < 0.9


def test_what_the_target_lacks_stays_far():
    body, body_normals = box((0.6, 0.3, 0.6), 500)
    mast, mast_normals = box((0.04, 0.4, 0.04), 150, centre=(0.0, 0.35, 0.0))
    template = RegistrationTemplate(
        np.concatenate([body, mast]), np.concatenate([body_normals, mast_normals]), SETTINGS
    )
    found = template.register(*box((0.6, 0.3, 0.6), 1200, seed=1))
    assert np.median(found.distance[:500]) < 0.03
    assert np.median(found.distance[500:]) > 0.06


def test_distances_are_those_to_the_points_named():
    points, normals = box((1.0, 0.5, 0.3), 200)
    target, target_normals = box((0.9, 0.6, 0.3), 300, seed=1)
    found = RegistrationTemplate(points, normals, SETTINGS).register(target, target_normals)
    place = found.points - target[found.target_index]
    turn = SETTINGS.normal_weight_end * (normals - target_normals[found.target_index])
    expected = np.sqrt((place**2).sum(1) + (turn**2).sum(1))
    np.testing.assert_allclose(found.distance, expected, atol=1e-5)


@pytest.mark.parametrize("start", [0.0, 0.5, 1.0])
def test_it_starts_between_copy_and_box_copy(start):
    points, normals = box((1.0, 0.5, 0.3), 200)
    settings = replace(SETTINGS, iterations=0, start=start)
    target, target_normals = box((0.5, 1.0, 0.3), 300, seed=1, centre=(0.0, 0.1, 0.0))
    found = RegistrationTemplate(points, normals, settings).register(target, target_normals)
    centre, _ = canonical_transform(points)
    other, _ = canonical_transform(target)
    copied = (points - centre) / np.ptp(points, axis=0) * np.ptp(target, axis=0) + other
    np.testing.assert_allclose(found.points, (1 - start) * points + start * copied, atol=1e-5)


def test_a_template_serves_many_targets_and_is_not_changed():
    points, normals = box((1.0, 0.5, 0.3), 200)
    template = RegistrationTemplate(points, normals, SETTINGS)
    targets = [box((0.9, 0.6, 0.3), 300, seed=1), box((0.7, 0.4, 0.5), 250, seed=2)]
    first = [template.register(*target).points for target in targets]
    again = [template.register(*target).points for target in targets]
    np.testing.assert_array_equal(first, again)
    assert np.abs(first[0] - first[1]).max() > 0.05


def test_small_clouds_are_matched_as_trees_would(monkeypatch):
    points, normals = box((1.0, 0.5, 0.3), 200)
    target = box((0.9, 0.6, 0.3), 300, seed=1)
    template = RegistrationTemplate(points, normals, SETTINGS)
    found = template.register(*target)
    monkeypatch.setattr(registration, "_ALL_COMPARED", 0)
    by_trees = template.register(*target)
    for values, expected in zip(vars(found).values(), vars(by_trees).values(), strict=True):
        np.testing.assert_allclose(values, expected, atol=1e-3)
    assert found.back.shape == (300,)


def test_what_is_alike_is_matched_where_places_mislead():
    """Two parallel sheets; the target's lie the other way round, and a feature tells which."""
    sheet = np.random.default_rng(0).uniform(-0.5, 0.5, (300, 3)) * [1, 0, 1]
    points = np.concatenate([sheet, sheet + np.array([0.0, 0.1, 0.0])])
    normals = np.tile([0.0, 1.0, 0.0], (600, 1))
    which = np.repeat([0.0, 1.0], 300)[:, None]
    target = points * [1, -1, 1] + [0.0, 0.1, 0.0]
    template = RegistrationTemplate(points, normals, SETTINGS)
    by_place = template.register(target, normals).target_index
    by_kind = template.register(target, normals, alike=(which, which)).target_index
    assert (which[by_place] == which).mean() < 0.5
    assert (which[by_kind] == which).all()
