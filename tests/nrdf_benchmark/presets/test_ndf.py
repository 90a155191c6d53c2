"""NDF: turning changes nothing that it should not; training; its two ways of finding points."""

import json

import pytest
import torch
from scipy.spatial.transform import Rotation

from builders.tiny_field import balls, tiny_config, write_folder
from nrdf.errors import ModelError
from nrdf.field import build_field
from nrdf.field.weights import load_weights
from nrdf.training.config import load_config
from nrdf.training.loop import train

SIZES = {"hidden": 8, "edge_channels": 8, "latent": 8, "decoder_width": 16, "encoder_blocks": 2}


@pytest.fixture
def field():
    torch.manual_seed(0)
    built = build_field("ndf", {**SIZES, "encoder_points": 300}).eval()
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


def test_moving_a_shape_moves_its_mean_and_nothing_else(field):
    points, move = 0.3 * torch.randn(1, 64, 3), torch.tensor([0.2, -0.1, 0.3])
    with torch.no_grad():
        z, moved = field.embed(points, points), field.embed(points + move, points)
        k, k_moved = field.describe(z, points, points), field.describe(moved, points + move, points)
    assert torch.allclose(z[:, -3:] + move, moved[:, -3:], atol=1e-6)
    assert torch.allclose(z[:, :-3], moved[:, :-3], atol=1e-4 * float(z.abs().max()))
    assert torch.allclose(k, k_moved, atol=1e-4)


def test_left_and_right_differ(field):
    """The cross product sees a reflection; inner products alone would not."""
    points = 0.3 * torch.randn(1, 64, 3)
    mirror = torch.tensor([1.0, 1.0, -1.0])
    both = torch.cat([points, points * mirror], dim=1)
    with torch.no_grad():
        k = field.describe(field.embed(both, both), both, both)[0]
    assert (k[:64] - k[64:]).abs().max() > 1e-3


def test_a_shape_alone_is_embedded_as_in_a_batch(field):
    points = 0.3 * torch.randn(3, 64, 3)
    with torch.no_grad():
        z, alone = field.embed(points, points), field.embed(points[1:2], points[1:2])
        assert torch.equal(alone, field.embed(points[1:2], points[1:2]))
    assert torch.allclose(z[1:2], alone, atol=1e-5 * float(z.abs().max()))


def test_folded_layers_equal_the_whole_ones(field):
    """W [<z, p>, <z, Vz>, |p|^2], of which the field never forms the input."""
    vectors, points = torch.randn(2, 8, 3), torch.randn(2, 20, 3)
    decoder = field.decoder
    with torch.no_grad():
        turned = torch.einsum("ij,bjc->bic", decoder.direction.weight, vectors)
        invariant = (vectors * turned).sum(-1)[:, None].expand(-1, 20, -1)
        product = torch.einsum("bqc,bic->bqi", points, vectors)
        square = points.square().sum(-1, keepdim=True)
        whole = decoder.enter(torch.cat([product, invariant, square], dim=-1))
        assert torch.allclose(decoder(vectors, points)[0], whole, atol=1e-4)


def test_the_sizes_are_as_described():
    built, points = build_field("ndf"), 0.3 * torch.randn(1, 128, 3)
    with torch.no_grad():
        z = built.embed(points, points)
        k = built.describe(z, points, points)
    assert z.shape == (1, 257 * 3) and k.shape == (1, 128, built.config.descriptor_size)
    assert torch.allclose(k.norm(dim=-1), torch.ones(1, 128), atol=1e-5)


@pytest.mark.parametrize("precision", ["float32", "bfloat16"])
def test_it_trains_on_occupancy_and_is_not_asked_for_correspondence(
    tmp_path, monkeypatch, precision
):
    monkeypatch.setattr("nrdf.training.progress._tensorboard", lambda folder, step: None)
    (tmp_path / "data").mkdir()
    write_folder(tmp_path / "data", balls(7))
    stage = {"name": "shape", "weights": {"occupancy": 1}, "batch_size": 4, "steps": 60}
    config = tiny_config(
        preset="ndf",
        field={**SIZES, "encoder_points": 64},
        stages=[{**stage, "rate": 0.01}],
        data={**tiny_config().data.model_dump(), "correspondences": 0, "queries": 128},
        precision=precision,
        log_every=10,
        checkpoint_every=1000,
        validate_every=1000,
    )
    path = train(config, [tmp_path / "data"], tmp_path / "run", category="ball", device="cpu")
    built, metadata = load_weights(path, "ndf", "ball")
    assert built.config.encoder_points == 64 and set(metadata["scores"]) == {
        "val/iou",
        "val/iou other",
    }
    logged = [json.loads(line) for line in (tmp_path / "run/metrics.jsonl").open()]
    losses = [line["loss/occupancy"] for line in logged if "loss/occupancy" in line]
    assert losses[-1] < 0.9 * losses[0]


@pytest.mark.parametrize("name", ["ndf", "ndf-short"])
def test_its_configurations_train_occupancy_alone(name):
    config = load_config(name)
    build_field(config.preset, config.field)
    assert config.preset == "ndf"
    assert [stage.weights for stage in config.stages] == [{"occupancy": 1}]


def test_every_weight_learns(field):
    points = 0.3 * torch.randn(2, 64, 3)
    field.occupancy(field.embed(points, points), points).square().sum().backward()
    for name, parameter in field.named_parameters():
        assert parameter.grad is not None and parameter.grad.abs().sum() > 0, name


def test_there_is_no_inverse(field):
    assert not field.inverts
    with pytest.raises(ModelError, match="no inverse descriptor function"):
        field.invert(torch.zeros(1, 24), torch.zeros(1, 4, 49))
