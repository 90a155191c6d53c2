"""PointNets without waste: the same numbers as the layers written out."""

from __future__ import annotations

import pytest
import torch
from torch.nn import functional

from nrdf.field.point_nets import (
    ConvolutionPointNet,
    ResidualBlock,
    ResidualPointNet,
    UnitLength,
    exact_linear,
    working_precision,
)


@pytest.fixture
def points():
    return torch.rand(3, 50, 3, generator=torch.Generator().manual_seed(0)) - 0.5


def test_what_is_the_same_at_all_points_may_be_given_once():
    torch.manual_seed(0)
    block = ResidualBlock(12, 6)
    torch.nn.init.normal_(block.outer.weight)
    x, constant = torch.randn(2, 5, 8), torch.randn(2, 1, 4)
    beside = torch.cat([x, constant.expand(2, 5, 4)], dim=-1)
    assert torch.allclose(block(x, constant), block(beside), atol=1e-5)


def test_the_residual_net_is_that_of_its_layers(points):
    torch.manual_seed(0)
    net = ResidualPointNet(8, 3)
    for block in net.blocks:
        torch.nn.init.normal_(block.outer.weight)
    x = net.enter(points)
    for number, block in enumerate(net.blocks):
        if number:
            x = torch.cat([x, x.amax(dim=1, keepdim=True).expand_as(x)], dim=-1)
        x = block(x)
    expected = net.leave(functional.relu(x.amax(dim=1)))
    assert torch.allclose(net(points), expected, atol=1e-5)


@pytest.mark.parametrize("training", [True, False])
def test_the_convolutions_are_those_of_the_layers(points, training):
    torch.manual_seed(0)
    nets = [ConvolutionPointNet(8) for _ in range(2)]
    with torch.no_grad():
        for norm in nets[0].norms:  # of either sign: where it is negative, the least point wins
            norm.weight.copy_(torch.randn_like(norm.weight))
            norm.running_mean.normal_()
            norm.running_var.uniform_(0.5, 2.0)
    nets[1].load_state_dict(nets[0].state_dict())
    for net in nets:
        net.train(training)
    x = points.transpose(1, 2)
    for convolution, norm in zip(nets[0].convolutions, nets[0].norms, strict=True):
        x = functional.relu(norm(convolution(x)))
    expected = nets[0].leave(functional.relu(nets[0].middle(x.amax(dim=2))))
    found = nets[1](points)
    assert torch.allclose(found, expected, atol=1e-4)
    for one, other in zip(nets[0].buffers(), nets[1].buffers(), strict=True):
        assert torch.allclose(one, other, atol=1e-5)


def test_unit_length_and_its_gradient_are_those_of_normalize():
    x = torch.randn(4, 7, requires_grad=True)
    assert torch.allclose(UnitLength.apply(x), functional.normalize(x, dim=-1), atol=1e-6)
    probe = torch.randn(4, 7)
    (ours,) = torch.autograd.grad((UnitLength.apply(x) * probe).sum(), x)
    (theirs,) = torch.autograd.grad((functional.normalize(x, dim=-1) * probe).sum(), x)
    assert torch.allclose(ours, theirs, atol=1e-5)


def test_coordinates_keep_their_precision_under_autocast():
    x, weight = torch.tensor([[1.001]]), torch.tensor([[1.0]])
    with torch.autocast("cpu", torch.bfloat16):
        assert float(exact_linear(x, weight)) == pytest.approx(1.001, abs=1e-6)
        assert working_precision(x).dtype == torch.bfloat16
    assert working_precision(x) is x
