"""The paper's network: its sizes, and that shared computation changes nothing."""

from __future__ import annotations

import pytest
import torch
from torch.nn import functional

from builders.small_paper import SMALL
from nrdf.field import build_field
from nrdf.field.paper import PaperConfig, PaperField


def cloud(b: int, n: int, seed: int = 0):
    generator = torch.Generator().manual_seed(seed)
    points = torch.rand(b, n, 3, generator=generator) - 0.5
    return points, functional.normalize(torch.randn(b, n, 3, generator=generator), dim=-1)


@pytest.fixture(scope="module")
def field() -> PaperField:
    torch.manual_seed(0)
    found = build_field("paper")
    assert isinstance(found, PaperField)
    # Blocks start as shortcuts; move everything so that every weight takes part.
    with torch.no_grad():
        for parameter in found.parameters():
            parameter.add_(0.02 * torch.randn_like(parameter))
    return found.eval()


def test_sizes_are_the_papers(field):
    points, normals = cloud(2, 50)
    z = field.embed(points, normals)
    assert z.shape == (2, 384)
    assert field.encoder.residual(points).shape == (2, 128)
    assert field.encoder.convolution(points).shape == (2, 256)
    assert field.occupancy(z, points).shape == (2, 50)
    k = field.describe(z, points, normals)
    assert k.shape == (2, 50, 1953)
    assert torch.allclose(k.norm(dim=-1), torch.ones(2, 50), atol=1e-5)
    assert field.inverse.enter.weight.shape == (1024, 2337)
    assert [block.outer.out_features for block in field.inverse.blocks] == [512, 256, 256]
    found = field.invert(z, k)
    assert found.points.shape == (2, 50, 3) and found.points.abs().max() <= 1
    assert found.normals is None and found.existence is None and found.log_error is None
    config = PaperConfig()
    assert (config.encoder_points, config.point_scale) == (8192, 10.0)


def test_there_are_six_million_parameters(field):
    count = sum(parameter.numel() for parameter in field.parameters())
    assert count == pytest.approx(6.2e6, rel=0.02)


def test_points_are_scaled_before_the_encoders_only(field):
    points, _ = cloud(1, 30)
    expected = torch.cat(
        [field.encoder.residual(10 * points), field.encoder.convolution(10 * points)], dim=-1
    )
    assert torch.allclose(field.encoder(points), expected)


def test_the_split_layers_equal_the_whole_ones(field):
    points, normals = cloud(2, 40)
    others, other_normals = cloud(2, 60, seed=1)
    with torch.no_grad():
        z, z_other = field.embed(points, normals), field.embed(others, other_normals)
        features = field.decoder.lift(points)
        repeated = z[:, None].expand(-1, 40, -1)
        x = field.decoder.enter(torch.cat([features, repeated], -1))
        assert torch.allclose(field.decoder(z, points)[1][..., :256], x, atol=1e-4)

        k = field.describe(z, points, normals)
        whole = torch.cat([z_other[:, None].expand(-1, 40, -1), k], -1)
        expected = field.inverse._rest(field.inverse.enter(whole))
        assert torch.allclose(field.invert(z_other, k).points, expected, atol=1e-4)
        assert torch.allclose(
            field.transfer(z, points, normals, z_other).points, expected, atol=1e-4
        )
        assert expected.std() > 1e-3


def test_the_descriptor_holds_every_layer_of_the_decoder(field):
    points, normals = cloud(1, 10)
    z = field.embed(points, normals)
    features, activations = field.decoder(z, points)
    raw = torch.cat([features, z[:, None].expand(-1, 10, -1), activations], -1)
    k = field.describe(z, points, normals)
    assert torch.allclose(k * raw.norm(dim=-1, keepdim=True), raw, atol=1e-4)
    assert torch.equal(activations[..., -1], field.occupancy(z, points))


def test_gradients_reach_every_weight():
    torch.manual_seed(0)
    field = build_field("paper", SMALL)
    points, normals = cloud(3, 40)
    optimizer = torch.optim.SGD(field.parameters(), 0.1)
    for _ in range(2):  # the blocks' second layers start at zero
        z = field.embed(points, normals)
        found = field.transfer(z, points, normals, z.roll(1, 0)).points
        loss = (found - points).square().mean() + field.occupancy(z, points).square().mean()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    for name, parameter in field.named_parameters():
        # A bias before batch normalisation is taken away with the batch's mean.
        free = name.startswith("encoder.convolution.convolutions") and name.endswith("bias")
        assert parameter.grad is not None and (free or parameter.grad.abs().sum() > 0), name


def test_the_embedding_does_not_depend_on_the_order_of_points(field):
    points, normals = cloud(1, 64)
    order = torch.randperm(64, generator=torch.Generator().manual_seed(0))
    assert torch.allclose(
        field.embed(points, normals), field.embed(points[:, order], normals[:, order]), atol=1e-5
    )


def test_the_logit_alone_is_that_of_the_descriptor(field):
    points, normals = cloud(2, 20)
    with torch.no_grad():
        z = field.embed(points, normals)
        assert torch.allclose(field.decoder(z, points)[1][..., -1], field.occupancy(z, points))


def test_a_prepared_descriptor_serves_several_targets(field):
    points, normals = cloud(2, 20)
    with torch.no_grad():
        z = field.embed(points, normals)
        k = field.describe(z, points, normals)
        prepared = field.prepare(k)
        for target in (z, z.flip(0)):
            beside = torch.cat([target[:, None].expand(-1, 20, -1), k], dim=-1)
            x = field.inverse.enter(beside)
            for block in field.inverse.blocks:
                x = block(x)
            expected = field.inverse.leave(functional.leaky_relu(x, 0.02)).tanh()
            found = field.invert_prepared(target, prepared).points
            assert torch.allclose(found, expected, atol=1e-4)
            assert torch.equal(found, field.invert(target, k).points)


def test_places_do_not_drown_beside_the_embedding_when_training_begins():
    field = build_field("paper").eval()
    points = torch.rand(4, 200, 3, generator=torch.Generator().manual_seed(0)) - 0.5
    with torch.no_grad():
        first = field.decoder(field.embed(points, points), points)[1][..., :256]
    assert first.std(dim=1).mean() > 0.2 * first.mean(dim=1).abs().mean()
    assert first.std(dim=1).mean() > 0.2  # 0.02 as torch starts the layer
