"""Descriptors searched on a target, by the nearest and by energy."""

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from nrdf.field import build_field
from nrdf.io.cloud import PointCloud
from nrdf.regions.model import Model
from nrdf_benchmark.methods.ndf_search import DescriptorSearch, nearest

SIZES = {"hidden": 8, "edge_channels": 8, "latent": 8, "decoder_width": 16, "encoder_blocks": 2}


@pytest.fixture
def field():
    torch.manual_seed(0)
    built = build_field("ndf", {**SIZES, "encoder_points": 300}).eval()
    with torch.no_grad():  # blocks start as the identity; here they must do something
        for parameter in built.parameters():
            parameter.add_(0.1 * torch.randn_like(parameter))
    return built


def test_nearest_is_the_nearest():
    wanted, among = torch.randn(30, 5), torch.randn(50, 5)
    brute = ((wanted[:, None] - among[None]) ** 2).sum(-1).argmin(1)
    assert np.array_equal(nearest(wanted, among), brute.numpy())


def test_nearest_is_not_misled_by_what_all_have_in_common():
    wanted = torch.randn(30, 40)
    common = 3000 * torch.ones(40)
    assert np.array_equal(nearest(wanted + common, wanted + common), np.arange(30))


def test_a_cloud_has_its_own_points_found_wherever_it_stands(field):
    points = np.random.default_rng(0).normal(0, [0.4, 0.2, 0.1], (300, 3))
    points[:, 0] += np.abs(points[:, 1])
    search = DescriptorSearch(Model(field, {"category": "chair"}))
    region = np.arange(10, 60)
    regions = {"a": region, "b": region[:5]}
    # Quarter turns, which keep the size of the bounding box and so the canonical scale.
    quarter = Rotation.from_euler("xy", [90, 90], degrees=True).as_matrix()
    for target in (points, 5 * points @ quarter.T + [1, 2, 3]):
        found = search.match(PointCloud(points), regions, PointCloud(target))
        assert np.array_equal(found["a"], region)
        assert np.array_equal(found["b"], region[:5])


def test_minimisation_lowers_the_energy(field, monkeypatch):
    monkeypatch.setattr("nrdf_benchmark.methods.ndf_search.STEPS", 40)
    points = np.random.default_rng(0).normal(0, [0.4, 0.2, 0.1], (300, 3))
    model = Model(field, {"category": "chair"})
    search = DescriptorSearch(model, energy=True)
    shape = model.encode(PointCloud(points))
    wanted = search._describe(shape, shape.points[:40])
    found = search._tensor(search._minimise(shape, wanted))
    start = search._tensor(shape.points[np.random.default_rng(0).integers(300, size=40)])
    with torch.no_grad():
        after = search._energy(shape.z, found, wanted).mean()
        before = search._energy(shape.z, start, wanted).mean()
    assert after < 0.5 * before
    assert all(parameter.grad is None for parameter in field.parameters())
    assert len(search.match(PointCloud(points), {"a": np.arange(9)}, PointCloud(points))["a"]) == 9
