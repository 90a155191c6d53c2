"""Optimizers: Adam, AdamW, and Muon, whose steps of a matrix go equally far in all directions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor, nn

from nrdf.field.base import Field
from nrdf.field.device import choose_precision
from nrdf.training.config import OptimizerConfig, Stage

_LEAST_SIDE = 16
_MOMENTUM = 0.95
_ROUNDS = 5
_COEFFICIENTS = (3.4445, -4.7750, 2.0315)
_AS_ADAM = 0.2  # root mean square of Adam's steps, in rates
_EPSILON = 1e-8


def make_optimizer(field: Field, stage: Stage, config: OptimizerConfig) -> torch.optim.Optimizer:
    """A fresh optimizer of the parameters that the stage trains."""
    trained = {name: p for name, p in field.named_parameters() if p.requires_grad}
    if not config.muon:
        kind = torch.optim.AdamW if config.name == "adamw" else torch.optim.Adam
        parameters = list(trained.values())
        return kind(parameters, stage.rate, config.betas, weight_decay=config.weight_decay)
    by_muon = {n for n, p in trained.items() if n.split(".")[0] in config.muon and is_matrix(p)}
    matrices = [p for name, p in trained.items() if name in by_muon]
    others = [p for name, p in trained.items() if name not in by_muon]
    return Muon(matrices, others, stage.rate, config.betas)


class Muon(torch.optim.Optimizer):
    """Momentum of which every matrix is made orthogonal before it is added; Adam for the rest.

    So the few strong directions of a gradient (what all shapes have in common) do not drown the
    many weak ones (what tells shapes apart). Jordan et al., "Muon", 2024; the scale, by which a
    rate means the same in both, is that of Liu et al., "Muon is Scalable for LLM Training", 2025.
    `torch.optim.Muon` (torch 2.9) takes no kernels of convolutions.
    """

    def __init__(
        self,
        matrices: Sequence[nn.Parameter],
        others: Sequence[nn.Parameter],
        rate: float,
        betas: tuple[float, float],
    ) -> None:
        groups = [
            {"params": list(matrices), "orthogonal": True},
            {"params": list(others), "orthogonal": False},
        ]
        super().__init__(groups, {"lr": rate, "betas": betas})

    @torch.no_grad()
    def step(self, closure: Any = None) -> None:  # type: ignore[override]
        """Step every parameter that has a gradient (no `closure` is called)."""
        for group in self.param_groups:
            for parameter in group["params"]:
                if parameter.grad is None:
                    continue
                state = self.state[parameter]
                if group["orthogonal"]:
                    step = _orthogonal_step(state, parameter.grad.flatten(1)).view_as(parameter)
                else:
                    step = _adam_step(state, parameter.grad, group["betas"])
                parameter.add_(step, alpha=-group["lr"])


def is_matrix(parameter: Tensor) -> bool:
    """Whether weights are stepped as a matrix. Not those of layers from coordinates, to coordinates
    and to a logit: they have too few directions."""
    return parameter.ndim > 1 and min(parameter.flatten(1).shape) >= _LEAST_SIDE


def _orthogonal_step(state: dict[str, Any], gradient: Tensor) -> Tensor:
    """The step (r, c) of a matrix at rate 1, of its gradient (r, c)."""
    if "momentum" not in state:
        state["momentum"] = torch.zeros_like(gradient)
    momentum = state["momentum"].lerp_(gradient, 1 - _MOMENTUM)
    step = orthogonal(gradient.lerp(momentum, _MOMENTUM)).to(gradient.dtype)
    return step * (_AS_ADAM * max(step.shape) ** 0.5)


def orthogonal(matrix: Tensor) -> Tensor:
    """Nearly U Vᵀ of a matrix U S Vᵀ (r, c): singular values between 0.7 and 1.2 in place of S.

    Five rounds of a polynomial of fifth degree (Newton and Schulz's iteration, with coefficients
    by which small values rise fast), in bfloat16 where the device multiplies in it.
    """
    a, b, c = _COEFFICIENTS
    x = matrix.to(choose_precision("auto", matrix.device))
    x = x / x.norm().clamp_min(1e-7)
    if x.shape[0] > x.shape[1]:
        x = x.mT
    for _ in range(_ROUNDS):
        square = x @ x.mT
        x = a * x + (b * square + c * square @ square) @ x
    return x.mT if matrix.shape[0] > matrix.shape[1] else x


def _adam_step(state: dict[str, Any], gradient: Tensor, betas: tuple[float, float]) -> Tensor:
    """Adam's step (Kingma & Ba, 2015) at rate 1, of a gradient of any shape."""
    if "steps" not in state:
        state["steps"] = 0
        state["mean"], state["square"] = torch.zeros_like(gradient), torch.zeros_like(gradient)
    state["steps"] += 1
    first, second = betas
    mean = state["mean"].lerp_(gradient, 1 - first) / (1 - first ** state["steps"])
    square = state["square"].lerp_(gradient.square(), 1 - second) / (1 - second ** state["steps"])
    return mean / (square.sqrt() + _EPSILON)
