"""Surfaces mapped by registration: onto a scaled copy, back, by threads, and what is missing."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import nrdf
from builders.small_model import chair
from nrdf.io.cloud import PointCloud
from nrdf.regions.presence import FIELD_RULE, REGISTRATION_RULE
from nrdf.regions.registration_mapper import RegistrationMapper

STRETCH = np.array([0.9, 1.0, 1.15])


@pytest.fixture(scope="module")
def model():
    return nrdf.load_model("registration")


@pytest.fixture(scope="module")
def mapper(model):
    return RegistrationMapper(model.encode(chair()[0]))


@pytest.fixture(scope="module")
def stretched(model):
    cloud = chair()[0]
    return model.encode(PointCloud(cloud.points * STRETCH, cloud.normals))


def errors(found, encoded, points):
    """Distances (m,) of mapped points from points (m, 3) of the target's cloud, canonical."""
    return np.linalg.norm(found.points - encoded.canonical(points), axis=1)


def test_presence_is_told_by_the_rule_of_what_begins_the_map(mapper, model):
    general = nrdf.load_model("general")
    begun = RegistrationMapper(general.encode(chair()[0]), general)
    assert (mapper.presence_rule, begun.presence_rule) == (REGISTRATION_RULE, FIELD_RULE)


def test_a_stretched_copy_is_followed(mapper, stretched):
    mapped = mapper.map_working(stretched)
    error = errors(mapped, stretched, stretched.cloud.points)
    assert np.median(error) < 0.02 and np.percentile(error, 95) < 0.06


def test_any_points_of_the_surface_move_with_their_neighbours(mapper, stretched):
    source = mapper.source
    some = mapper.map_points(source.points[:100], source.normals[:100], stretched)
    whole = mapper.map_working(stretched, np.arange(100))
    np.testing.assert_allclose(some.points, whole.points, atol=1e-6)


def test_points_come_back_to_where_they_were(mapper, stretched):
    back = mapper.map_back(stretched, np.arange(200))
    error = np.linalg.norm(back.points - mapper.source.points[:200], axis=1)
    assert np.median(error) < 0.02


def test_a_target_is_registered_once_whoever_asks(model, stretched, monkeypatch):
    mapper, calls = RegistrationMapper(model.encode(chair()[0])), []
    register = mapper._template.register
    monkeypatch.setattr(
        mapper._template, "register", lambda *given: calls.append(1) or register(*given)
    )
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda _: mapper.map_working(stretched), range(4)))
    assert len(calls) == 1
    assert all(one.points is found[0].points for one in found)


def test_with_the_general_field_it_begins_there_and_knows_its_error():
    model = nrdf.load_model("general")
    cloud = chair()[0]
    far = np.array([0.7, 1.0, 1.6])
    source = model.encode(cloud)
    target = model.encode(PointCloud(cloud.points * far, cloud.normals))
    mapper = RegistrationMapper(source, model)
    mapped = mapper.map_working(target)
    assert errors(mapped, target, target.cloud.points).mean() < 0.015
    assert (mapped.error > 0).all()
    back = mapper.map_back(target, np.arange(200))
    assert np.linalg.norm(back.points - source.points[:200], axis=1).mean() < 0.015
