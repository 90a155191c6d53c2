"""Optimizers: which parameters they take, and Muon against what it is defined by."""

from __future__ import annotations

import pytest
import torch
from torch import Tensor, nn

from nrdf.field.paper import PaperField
from nrdf.training.config import load_config
from nrdf.training.loop import select_parts
from nrdf.training.optimizer import Muon, is_matrix, make_optimizer, orthogonal


def test_orthogonal_matrices_have_like_singular_values() -> None:
    matrix = torch.randn(40, 90, generator=torch.Generator().manual_seed(0))
    matrix[:20] *= 30  # half of the directions are far stronger
    for given in (matrix, matrix.T):
        values = torch.linalg.svdvals(orthogonal(given).float())
        assert values.min() > 0.6 and values.max() < 1.3
    left, _, right = torch.linalg.svd(matrix, full_matrices=False)
    assert (orthogonal(matrix).float() - left @ right).abs().max() < 0.2


def test_a_gradient_of_zero_changes_nothing() -> None:
    parameter = nn.Parameter(torch.ones(16, 16))
    parameter.grad = torch.zeros_like(parameter)
    Muon([parameter], [], 0.1, (0.9, 0.999)).step()
    assert torch.equal(parameter, torch.ones_like(parameter))


def descend(parameter: nn.Parameter, optimizer: torch.optim.Optimizer) -> Tensor:
    """Where a parameter is after four steps of one sequence of gradients."""
    generator = torch.Generator().manual_seed(1)
    for _ in range(4):
        parameter.grad = torch.randn(parameter.shape, generator=generator)
        optimizer.step()
    return parameter.detach()


def test_others_are_stepped_as_by_adam() -> None:
    ours, theirs = nn.Parameter(torch.ones(3, 40)), nn.Parameter(torch.ones(3, 40))
    descend(ours, Muon([], [ours], 0.01, (0.9, 0.99)))
    descend(theirs, torch.optim.Adam([theirs], 0.01, (0.9, 0.99)))
    assert torch.allclose(ours, theirs, atol=1e-6)


@pytest.mark.skipif(not hasattr(torch.optim, "Muon"), reason="torch.optim.Muon is of torch 2.9")
@pytest.mark.parametrize("shape", [(20, 50), (50, 20)])
def test_matrices_are_stepped_as_by_torch(shape: tuple[int, int]) -> None:
    ours, theirs = nn.Parameter(torch.zeros(shape)), nn.Parameter(torch.zeros(shape))
    descend(ours, Muon([ours], [], 0.01, (0.9, 0.99)))
    adjust = "match_rms_adamw"
    descend(theirs, torch.optim.Muon([theirs], 0.01, weight_decay=0.0, adjust_lr_fn=adjust))
    # torch's is in bfloat16 everywhere, ours where the processor multiplies in it
    assert torch.allclose(ours, theirs, atol=0.002)
    assert ours.abs().max() > 0.004


def test_a_kernel_of_a_convolution_is_its_matrix() -> None:
    matrix, kernel = nn.Parameter(torch.zeros(20, 50)), nn.Parameter(torch.zeros(20, 50, 1))
    descend(matrix, Muon([matrix], [], 0.01, (0.9, 0.99)))
    descend(kernel, Muon([kernel], [], 0.01, (0.9, 0.99)))
    assert torch.equal(kernel[..., 0], matrix)


@pytest.mark.parametrize(
    ("shape", "expected"),
    [((20,), False), ((3, 64), False), ((64, 3, 1), False), ((64, 64), True), ((64, 64, 1), True)],
)
def test_layers_from_or_to_coordinates_are_no_matrices(
    shape: tuple[int, ...], expected: bool
) -> None:
    assert is_matrix(torch.zeros(shape)) is expected


def test_muon_steps_the_matrices_of_the_named_parts() -> None:
    config = load_config("paper-short")
    assert config.optimizer.muon == ["encoder", "decoder"]
    field = PaperField()
    for stage in config.stages:
        trained = {id(parameter) for parameter in select_parts(field, stage)}
        optimizer = make_optimizer(field, stage, config.optimizer)
        matrices, others = ({id(p) for p in group["params"]} for group in optimizer.param_groups)
        assert matrices | others == trained and not matrices & others
        assert id(field.decoder.enter.weight) in matrices
        assert id(field.encoder.convolution.convolutions[1].weight) in matrices
        assert id(field.decoder.lift.weight) in others and id(field.decoder.leave.weight) in others
        assert id(field.inverse.enter.weight) not in matrices
