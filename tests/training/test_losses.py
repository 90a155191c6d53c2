"""Losses on cases whose value is known, and all of them on a tiny field."""

from __future__ import annotations

import math
from types import SimpleNamespace

import pytest
import torch

from builders.tiny_field import TinyField, balls, tiny_config
from nrdf.field.base import Inverse
from nrdf.training import losses
from nrdf.training.dataset import ShapeDataset
from nrdf.training.losses import LOSSES, LossContext


@pytest.fixture
def context():
    torch.manual_seed(0)
    config = tiny_config().data
    batch = ShapeDataset(balls(), config).batch(4, 0, 0)
    return LossContext(TinyField(), batch, torch.Generator().manual_seed(0), config.cloud_points)


TRAINING = sorted(LOSSES.keys() - {"coarse_correspondence"})  # the tiny field does not refine


@pytest.mark.parametrize("name", TRAINING)
def test_every_loss_is_finite_and_trains_the_field(context, name):
    value = LOSSES[name](context)
    assert value.shape == () and value.isfinite()
    value.backward()
    gradients = [p.grad for p in context.field.parameters() if p.grad is not None]
    assert gradients and all(gradient.isfinite().all() for gradient in gradients)
    assert sum(float(gradient.abs().sum()) for gradient in gradients) > 0


@pytest.mark.parametrize("name", TRAINING)
def test_every_loss_falls_when_it_is_followed(context, name):
    optimizer = torch.optim.Adam(context.field.parameters(), 5e-4)
    values = []
    for _ in range(25):
        context = LossContext(
            context.field, context.batch, torch.Generator().manual_seed(0), context.cloud_points
        )
        value = LOSSES[name](context)
        optimizer.zero_grad()
        value.backward()
        optimizer.step()
        values.append(float(value.detach()))
    assert values[-1] < values[0]


def test_every_loss_states_its_formula():
    assert all(loss.__doc__ and len(loss.__doc__) > 30 for loss in LOSSES.values())


def test_chamfer_is_squared_and_sums_both_directions():
    a = torch.tensor([[[0.0, 0, 0], [1, 0, 0]]])
    b = torch.tensor([[[0.0, 0, 2]]])
    assert float(losses.chamfer_distance(a, b)) == pytest.approx((4 + 5) / 2 + 4)


def test_emd_counts_every_point_once():
    a = torch.zeros(1, 2, 3)
    b = torch.tensor([[[0.0, 0, 0], [0, 3, 0]]])
    assert float(losses.earth_movers_distance(a, b)) == pytest.approx(1.5, abs=1e-5)


def pair(found: Inverse, **batch) -> SimpleNamespace:
    return SimpleNamespace(transferred=found, batch=SimpleNamespace(**batch), z=torch.zeros(1))


def test_correspondence_is_robust_and_weighted():
    target = torch.zeros(1, 3, 3)
    points = torch.tensor([[[0.0, 0, 0], [3, 4, 0], [100, 0, 0]]])
    weight = torch.tensor([[1.0, 0.5, 0.0]])
    value = losses.correspondence(pair(Inverse(points), target=target, weight=weight))
    assert float(value) == pytest.approx(0.5 * (5 - losses.ROBUST) / 1.5, rel=1e-3)


def test_no_weight_at_all_is_zero_with_zero_gradient():
    points = torch.ones(1, 3, 3, requires_grad=True)
    value = losses.correspondence(
        pair(Inverse(points), target=torch.zeros(1, 3, 3), weight=torch.zeros(1, 3))
    )
    value.backward()
    assert float(value.detach()) == 0 and (points.grad == 0).all()


def test_normal_is_one_minus_the_cosine():
    normals = torch.tensor([[[2.0, 0, 0], [0, 0, -1]]])
    truth = torch.tensor([[[1.0, 0, 0], [0, 0, 1]]])
    found = Inverse(torch.zeros(1, 2, 3), normals)
    value = losses.normal(pair(found, target_normals=truth, weight=torch.ones(1, 2)))
    assert float(value) == pytest.approx(1.0)


def test_existence_listens_to_what_is_known_only():
    found = Inverse(torch.zeros(2, 2, 3), existence=torch.tensor([[2.0, -2.0], [9.0, 9.0]]))
    weight = torch.tensor([[1.0, 0.0], [0.0, 0.0]])
    value = losses.existence(
        pair(found, weight=weight, known=torch.tensor([[True, True], [False, False]]))
    )
    assert float(value) == pytest.approx(math.log(1 + math.exp(-2)), rel=1e-5)


def test_error_scale_is_least_at_the_true_error_and_does_not_move_points():
    points = torch.full((1, 1, 3), 0.1, requires_grad=True)
    truth = 0.1 * math.sqrt(3)
    values = []
    for factor in (0.8, 1.0, 1.25):
        found = Inverse(points, log_error=torch.full((1, 1), math.log(truth * factor)))
        values.append(
            losses.error_scale(pair(found, target=torch.zeros(1, 1, 3), weight=torch.ones(1, 1)))
        )
    assert values[1] < values[0] and values[1] < values[2]
    assert not values[0].requires_grad


def test_fields_without_extra_predictions_lose_nothing_by_them():
    bare = pair(Inverse(torch.zeros(1, 1, 3)), target=torch.zeros(1, 1, 3), weight=torch.ones(1, 1))
    assert all(
        float(LOSSES[name](bare)) == 0
        for name in ("normal", "existence", "error_scale", "coarse_correspondence")
    )


def test_self_and_cross_reconstruction_meet_their_own_targets(context):
    context.self_reconstruction = context.cloud
    context.cross_reconstruction = context.cloud[context.partner]
    assert float(losses.self_reconstruction(context)) == 0
    assert float(losses.chamfer(context)) < 1e-9
    assert float(losses.emd(context)) < 1e-5
    context.cross_reconstruction = context.cloud
    assert float(losses.chamfer(context)) > 1e-3


def test_smoothness_of_equal_descriptors_is_zero(context):
    context.descriptors = torch.ones(4, context.cloud_points, 5)
    assert float(losses.descriptor_smoothness(context)) < 1e-5
