import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from nrdf.benchmark.ndf import DescriptorSearch, nearest
from nrdf.cloud import PointCloud
from nrdf.errors import ModelError
from nrdf.field import build_field
from nrdf.regions.model import Model


@pytest.fixture
def field():
    torch.manual_seed(0)
    sizes = {"hidden": 8, "edge_channels": 8, "latent": 8, "decoder_width": 16}
    built = build_field("ndf", {**sizes, "encoder_points": 128, "encoder_blocks": 2}).eval()
    with torch.no_grad():  # blocks start as the identity; here they must do something
        for parameter in built.parameters():
            parameter.add_(0.1 * torch.randn_like(parameter))
    return built


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_z_turns_with_the_shape_and_descriptors_do_not_change(field, seed):
    generator = torch.Generator().manual_seed(seed)
    points = 0.3 * torch.randn(2, 64, 3, generator=generator)
    queries = 0.3 * torch.randn(2, 20, 3, generator=generator)
    turn = torch.tensor(Rotation.random(random_state=seed).as_matrix(), dtype=torch.float32)
    with torch.no_grad():
        z, turned = field.embed(points, points), field.embed(points @ turn.T, points)
        k = field.describe(z, queries, queries)
        k_turned = field.describe(turned, queries @ turn.T, queries)
        occupancy = field.occupancy(turned, queries @ turn.T)
    vectors, rotated = z.unflatten(1, (-1, 3)), turned.unflatten(1, (-1, 3))
    scale = float(vectors.abs().max())
    assert torch.allclose(vectors @ turn.T, rotated, atol=1e-4 * scale)
    assert not torch.allclose(vectors, rotated, atol=1e-2 * scale)
    assert torch.allclose(k, k_turned, atol=1e-4)
    assert torch.allclose(field.occupancy(z, queries), occupancy, atol=1e-4 * occupancy.abs().max())
    assert float(k.std(dim=1).mean()) > 1e-3  # not the same everywhere


def test_every_weight_learns(field):
    points = 0.3 * torch.randn(2, 64, 3)
    field.occupancy(field.embed(points, points), points).square().sum().backward()
    for name, parameter in field.named_parameters():
        assert parameter.grad is not None and parameter.grad.abs().sum() > 0, name


def test_there_is_no_inverse(field):
    assert not field.inverts
    with pytest.raises(ModelError, match="no inverse descriptor function"):
        field.invert(torch.zeros(1, 24), torch.zeros(1, 4, 49))


def test_nearest_is_the_nearest():
    wanted, among = torch.randn(30, 5), torch.randn(50, 5)
    brute = ((wanted[:, None] - among[None]) ** 2).sum(-1).argmin(1)
    assert np.array_equal(nearest(wanted, among), brute.numpy())


def test_a_turned_copy_has_its_points_found(field):
    points = np.random.default_rng(0).normal(0, [0.4, 0.2, 0.1], (300, 3))
    points[:, 0] += np.abs(points[:, 1])
    search = DescriptorSearch(Model(field, {"category": "chair"}))
    region = np.arange(10, 60)
    same = search.match(PointCloud(points), {"a": region, "b": region[:5]}, PointCloud(points))
    assert np.array_equal(same["a"], region)
    assert np.array_equal(same["b"], region[:5])


def test_minimisation_lowers_the_energy(field, monkeypatch):
    monkeypatch.setattr("nrdf.benchmark.ndf.STEPS", 40)
    points = np.random.default_rng(0).normal(0, [0.4, 0.2, 0.1], (300, 3))
    model = Model(field, {"category": "chair"})
    search = DescriptorSearch(model, energy=True)
    shape = model.embed(PointCloud(points))
    wanted = search._describe(shape, shape.points[:40])
    found = search._tensor(search._minimise(shape, wanted))
    start = search._tensor(shape.points[np.random.default_rng(0).integers(300, size=40)])
    with torch.no_grad():
        after = search._energy(shape.z, found, wanted).mean()
        before = search._energy(shape.z, start, wanted).mean()
    assert after < 0.5 * before
    assert len(search.match(PointCloud(points), {"a": np.arange(9)}, PointCloud(points))["a"]) == 9
