"""A field's retrieval as a method of the benchmark."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from builders.bsrc_folder import member_clouds
from builders.small_model import SMALL
from nrdf.field import build_field
from nrdf.io.cloud import PointCloud
from nrdf.regions.model import Model
from nrdf_benchmark.methods.learned import FieldMethod


@pytest.fixture(scope="module")
def model() -> Model:
    torch.manual_seed(0)
    return Model(build_field("default", SMALL), {"category": "chair"})


@pytest.fixture(scope="module")
def clouds():
    """The first two are the same object, the third is another."""
    made = member_clouds("chair", (0, 0, 1))
    return [PointCloud(points) for points, _ in made], dict(enumerate(made[0][1]))


def test_a_mask_is_what_the_model_retrieves(model, clouds):
    (first, _, third), regions = clouds
    found = FieldMethod(model, "mask")(first, regions, third)
    expected = model.set_reference(first).retrieve_all(regions, third)
    for name, match in expected.items():
        np.testing.assert_array_equal(found[name], match.indices)


def test_points_are_snapped_one_by_one_by_position_alone(model, clouds):
    (first, second, third), regions = clouds
    found = FieldMethod(model, "points")(first, regions, third)
    expected = model.set_reference(first).retrieve_all(regions, third, "points")
    for name, match in expected.items():
        assert len(found[name]) == len(regions[name])
        distance = np.linalg.norm(match.points[:, None] - third.points, axis=2)
        np.testing.assert_array_equal(found[name], distance.argmin(1))
    # An untrained field starts with the bounding box copy: the identity on the same object.
    same = FieldMethod(model, "points")(first, regions, second)
    for name, indices in regions.items():
        np.testing.assert_array_equal(same[name], indices)


def test_the_reference_is_taught_once_and_every_target_embedded(model, clouds, monkeypatch):
    (first, second, third), regions = clouds
    calls = []
    embed = model.field.embed
    monkeypatch.setattr(model.field, "embed", lambda *a: calls.append(1) or embed(*a))
    match = FieldMethod(model, "mask")
    for target in (second, third, second):
        match(first, regions, target)
    assert len(calls) == 1 + 3
    match(third, regions, second)
    assert len(calls) == 1 + 3 + 2
