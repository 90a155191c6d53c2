"""The default preset: sizes, where C starts, the feature planes, gradients, weight files."""

from __future__ import annotations

import pytest
import torch
from torch.nn import functional

from nrdf.errors import ConfigError
from nrdf.field import build_field
from nrdf.field.default import _PLANE_SIDE, DefaultField, encoded_size, sample_planes
from nrdf.field.weights import load_weights, save_weights

SMALL = {
    "encoder_points": 64,
    "latent": 10,
    "point_features": 12,
    "plane_channels": 4,
    "plane_cells": 8,
    "plane_layers": 1,
    "octaves": 2,
    "decoder_width": 16,
    "decoder_blocks": 1,
    "inverse_width": 14,
    "inverse_blocks": 1,
    "refine_blocks": 1,
}


def cloud(b: int, n: int, seed: int = 0):
    generator = torch.Generator().manual_seed(seed)
    size = 0.3 + 0.7 * torch.rand(b, 1, 3, generator=generator)
    points = (torch.rand(b, n, 3, generator=generator) - 0.5) * size
    return points, functional.normalize(torch.randn(b, n, 3, generator=generator), dim=-1)


@pytest.fixture
def fresh() -> DefaultField:
    torch.manual_seed(0)
    return build_field("default", SMALL).eval()


@pytest.fixture
def moved(fresh) -> DefaultField:
    """Moved away from the start, where layers that are 0 hide what is behind them."""
    with torch.no_grad():
        for parameter in fresh.parameters():
            parameter.add_(0.1 * torch.randn_like(parameter))
    return fresh


def test_sizes_of_everything(moved):
    points, normals = cloud(2, 50)
    z = moved.embed(points, normals)
    assert z.shape == (2, 10 + 3 + 3 * 4 * 8 * 8 + 2 * 50 * 3)
    assert moved.occupancy(z, points[:, :30]).shape == (2, 30)
    k = moved.describe(z, points, normals)
    assert k.shape == (2, 50, 16 * 2 + 1 + 9) == (2, 50, moved.decoder.descriptor_size)
    found = moved.invert(z, k)
    assert found.points.shape == found.normals.shape == found.coarse_points.shape == (2, 50, 3)
    assert found.existence.shape == found.log_error.shape == (2, 50)
    assert torch.allclose(found.normals.norm(dim=-1), torch.ones(2, 50), atol=1e-5)
    assert encoded_size(2) == 15


def test_the_defaults_fit_into_a_weight_file_of_8_megabytes():
    field = build_field("default")
    numbers = sum(value.numel() for value in field.state_dict().values())
    assert 2 * numbers < 8e6
    assert field.config.encoder_points == 1024


def test_a_size_that_it_does_not_have_is_refused():
    with pytest.raises(ConfigError, match="plane_channels"):
        build_field("default", {"plane_chanels": 3})


def test_the_embedding_holds_the_bounding_box(moved):
    points, normals = cloud(3, 40)
    extents = moved.embed(points, normals)[:, 10:13]
    assert torch.allclose(extents, points.amax(1) - points.amin(1))


def test_c_starts_half_way_between_copy_and_box_copy(fresh):
    points, normals = cloud(1, 60)
    others, other_normals = cloud(1, 80, seed=1)
    z, z_other = fresh.embed(points, normals), fresh.embed(others, other_normals)
    found = fresh.invert(z_other, fresh.describe(z, points, normals))
    extents = (p.amax(1, keepdim=True) - p.amin(1, keepdim=True) for p in (others, points))
    grown = points * next(extents) / next(extents)
    assert (grown - points).abs().max() > 0.02
    assert torch.allclose(found.points, (points + grown) / 2, atol=1e-6)
    assert torch.equal(found.points, found.coarse_points)
    assert torch.allclose(found.normals, normals, atol=1e-6)
    assert (found.existence == 3).all() and (found.log_error == -3).all()
    own = fresh.invert(z, fresh.describe(z, points, normals))
    assert torch.allclose(own.points, points, atol=1e-6)


def test_the_two_sides_of_a_thin_part_have_different_descriptors(moved):
    points, normals = cloud(1, 20)
    z = moved.embed(points, normals)
    front, back = moved.describe(z, points, normals), moved.describe(z, points, -normals)
    assert not torch.equal(front, back)
    assert (moved.invert(z, front).points - moved.invert(z, back).points).abs().max() > 1e-4


@pytest.mark.parametrize(("plane", "row", "column"), [(0, 0, 1), (1, 1, 2), (2, 2, 0)])
def test_a_plane_is_read_where_the_point_is(plane, row, column):
    """Planes are (x, y), (y, z), (z, x), the first axis along the rows."""
    cells = 8
    planes = torch.zeros(1, 3, 2, cells, cells)
    planes[0, plane, 1, 2, 5] = 1.0

    def centre(cell):
        return ((cell + 0.5) / cells - 0.5) * _PLANE_SIDE

    point = torch.full((3,), 0.123)
    point[row], point[column] = centre(2), centre(5)
    swapped = point.clone()
    swapped[row], swapped[column] = centre(5), centre(2)
    between = point.clone()
    between[column] = centre(4.75)
    out = sample_planes(planes, torch.stack([point, swapped, between])[None])[0]
    assert out.shape == (3, 6)
    expected = torch.zeros(3, 6)
    expected[0, 2 * plane + 1], expected[2, 2 * plane + 1] = 1.0, 0.75
    assert torch.allclose(out, expected, atol=1e-5)


def test_a_point_s_feature_is_found_where_the_point_is():
    """Writing and reading agree about axes, cells and the order within a batch."""
    torch.manual_seed(0)
    field = build_field("default", {**SMALL, "plane_layers": 0})
    encoder = field.encoder
    with torch.no_grad():
        encoder.context.weight.zero_()
        encoder.context.bias.zero_()
    cells = 8
    cell = torch.tensor([[[1, 3, 6], [4, 4, 4]], [[2, 7, 0], [5, 1, 3]]])
    points = ((cell + 0.5) / cells - 0.5) * _PLANE_SIDE
    features = torch.zeros(2, 2, 4)
    features[0, 0, 1] = features[1, 0, 2] = 1.0
    planes = encoder._planes(points, features, torch.zeros(2, 10))
    out = sample_planes(planes, points).unflatten(-1, (3, 4))
    assert torch.allclose(out, features[:, :, None].expand(-1, -1, 3, -1), atol=1e-5)
    # Two points in a cell share their mean.
    planes = encoder._planes(points[:1, [0, 0]], features[:1], torch.zeros(1, 10))
    assert planes[0, :, 1].amax(dim=(1, 2)).tolist() == [0.5] * 3


def test_shapes_of_a_batch_do_not_mix(moved):
    points, normals = cloud(3, 50)
    others, other_normals = cloud(3, 20, seed=1)
    z = moved.embed(points, normals)
    found = moved.invert(z, moved.describe(z, others, other_normals)).points
    for i in range(3):
        one = slice(i, i + 1)
        alone = moved.embed(points[one], normals[one])
        assert torch.allclose(alone, z[one], atol=1e-5)
        k = moved.describe(alone, others[one], other_normals[one])
        assert torch.allclose(moved.invert(alone, k).points, found[one], atol=1e-5)


def test_the_order_of_points_does_not_matter(moved):
    points, normals = cloud(1, 64)
    order = torch.randperm(64, generator=torch.Generator().manual_seed(0))
    z = moved.embed(points, normals)
    again = moved.embed(points[:, order], normals[:, order])
    assert torch.allclose(again[:, : -6 * 64], z[:, : -6 * 64], atol=1e-5)
    assert torch.allclose(moved.occupancy(again, points), moved.occupancy(z, points), atol=1e-5)
    k = moved.describe(z, points, normals)
    assert torch.allclose(moved.describe(z, points[:, order], normals[:, order]), k[:, order])


def test_gradients_reach_every_weight(moved):
    moved.train()
    points, normals = cloud(3, 40)
    z = moved.embed(points, normals)
    found = moved.transfer(z, points, normals, z.roll(1, 0))
    loss = (found.points - points).square().mean() + (found.normals * normals.roll(1, 1)).mean()
    loss = loss + found.existence.sigmoid().mean() + found.log_error.exp().mean()
    (loss + moved.occupancy(z, points).square().mean()).backward()
    still = [name for name, p in moved.named_parameters() if p.grad is None or not p.grad.any()]
    assert still == []


def test_it_survives_a_weight_file(moved, tmp_path):
    points, normals = cloud(1, 40)
    save_weights(tmp_path / "x", moved, {"category": "chair"})
    loaded, metadata = load_weights(tmp_path / "x", "default", "chair")
    assert isinstance(loaded, DefaultField) and loaded.config == moved.config
    assert metadata["field"]["plane_cells"] == 8
    before, after = (
        field.transfer(z, points, normals, z).points
        for field in (moved, loaded)
        for z in [field.embed(points, normals)]
    )
    assert (before - points).abs().mean() > 0.01
    assert torch.allclose(before, after, atol=5e-3)  # half precision
