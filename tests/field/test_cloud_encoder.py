"""Encoding clouds: any unit and place, a pose, and a half that is completed by its mirror image."""

from __future__ import annotations

import numpy as np
import torch

from builders.small_model import build, chair
from nrdf.field.cloud_encoder import WORKING_POINTS, CloudEncoder
from nrdf.geometry.similarity import Similarity
from nrdf.io.cloud import PointCloud
from nrdf.shapes.families import get_family


def test_unit_and_place_of_a_cloud_do_not_matter():
    model, (cloud, _) = build(), chair()
    assert isinstance(model, CloudEncoder)
    far = PointCloud(1000.0 * cloud.points + [200.0, -4000.0, 50.0], cloud.normals)
    one, two = model.encode(cloud), model.encode(far)
    assert torch.allclose(one.z, two.z, atol=1e-4)
    np.testing.assert_allclose(one.points, two.points, atol=1e-6)
    np.testing.assert_allclose(two.original(two.points), far.points, atol=1e-3)
    assert set(one.seconds) == {"normalise", "normals", "embed"}


def test_a_dense_cloud_is_thinned_to_its_working_points():
    cloud, _ = chair(count=WORKING_POINTS + 500)
    encoded = build().encode(cloud)
    assert len(encoded.working) == len(encoded.points) == len(encoded.normals) == WORKING_POINTS
    assert not encoded.is_whole and len(np.unique(encoded.working)) == WORKING_POINTS


def test_a_mirrored_half_is_encoded_as_the_whole():
    family = get_family("chair")
    sample = family.member(1).sample_surface(8000, np.random.default_rng(0))
    whole = PointCloud(sample.points, sample.normals)
    half = whole.select(sample.points[:, 2] > 0)
    model = build()
    pose = Similarity(np.eye(3), np.zeros(3), 1.0)
    z, seen, completed = (
        model.encode(cloud, pose, mirrored).z
        for cloud, mirrored in ((whole, False), (half, False), (half, True))
    )
    # What is coded of it; the points behind that are not the same ones.
    z, seen, completed = (z[:, : model.field._coded] for z in (z, seen, completed))
    assert (completed - z).norm() < 0.3 * (seen - z).norm()
    points = model.encode(half, pose, mirrored=True).points
    assert (points[:, 2] > 0).all(), "only the field sees the mirror image"
