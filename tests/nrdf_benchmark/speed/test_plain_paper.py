"""The plain reading of the paper's losses, against those that training takes."""

from __future__ import annotations

import pytest
import torch

from builders.small_paper import SMALL
from builders.tiny_field import balls, tiny_config
from nrdf.field import build_field
from nrdf.training.dataset import ShapeDataset
from nrdf.training.losses import LOSSES, LossContext
from nrdf_benchmark.speed.plain_paper import PlainPaper

NAMES = (
    "occupancy",
    "self",
    "chamfer",
    "emd",
    "smoothness",
    "normal_consistency",
    "descriptor_distance",
)


@pytest.fixture
def sides():
    """The same losses twice, each of a field of the same weights: plain, and as in training."""
    torch.manual_seed(0)
    config = tiny_config().data.model_copy(update={"encoder_points": 60, "cloud_points": 40})
    batch = ShapeDataset(balls(), config).batch(3, 0, 0)
    fields = [build_field("paper", SMALL).train() for _ in range(2)]
    with torch.no_grad():  # blocks start as the identity; here they must do something
        for parameter in fields[0].parameters():
            parameter.add_(0.1 * torch.randn_like(parameter))
    fields[1].load_state_dict(fields[0].state_dict())
    generator = [torch.Generator().manual_seed(0) for _ in fields]
    plain = PlainPaper(fields[0], 40).losses(batch, NAMES, generator[0])
    context = LossContext(fields[1], batch, generator[1], 40)
    return plain, {name: LOSSES[name](context) for name in NAMES}, fields


def test_every_loss_equals_the_plain_one(sides):
    plain, ours, _ = sides
    for name in NAMES:
        # The bijection in training is up to a fifth above the least.
        close = {"rel": 0.2} if name == "emd" else {"rel": 2e-4, "abs": 1e-6}
        assert float(ours[name].detach()) == pytest.approx(float(plain[name].detach()), **close)


def test_gradients_and_running_statistics_equal_the_plain_ones(sides):
    plain, ours, fields = sides
    # The derivative of a normal grows without bound where its plane is not certain.
    for losses in (plain, ours):
        sum(losses[n] for n in NAMES if n not in ("emd", "normal_consistency")).backward()
    for (name, one), other in zip(
        fields[0].named_parameters(), fields[1].parameters(), strict=True
    ):
        assert torch.allclose(one.grad, other.grad, rtol=1e-3, atol=1e-4), name
    for (name, one), other in zip(fields[0].named_buffers(), fields[1].buffers(), strict=True):
        assert torch.allclose(one, other, rtol=1e-4, atol=1e-5), name
