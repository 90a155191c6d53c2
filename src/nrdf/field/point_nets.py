"""PointNets and residual blocks of the paper's network, computed without waste.

The numbers are those of the layers as they are written in the papers; what differs is how much is
computed. What is the same at all points of an object is multiplied once an object. Coordinates meet
their first layer in single precision: in bfloat16 a point is off by a five-hundredth of its size.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional


def exact_linear(x: Tensor, weight: Tensor, bias: Tensor | None = None) -> Tensor:
    """A linear layer (…, in) to (…, out) in single precision, whatever is around it."""
    with torch.autocast(x.device.type, enabled=False):
        bias = None if bias is None else bias.float()
        return functional.linear(x.float(), weight.float(), bias)


def working_precision(x: Tensor) -> Tensor:
    """Values in the precision that matrices are multiplied in here: autocast's, if it is on."""
    kind = x.device.type
    return x.to(torch.get_autocast_dtype(kind)) if torch.is_autocast_enabled(kind) else x


class UnitLength(torch.autograd.Function):
    """x / ‖x‖ of rows x (…, d), in the precision of x; lengths in single precision.

    Its derivative is that of `torch.nn.functional.normalize`, which is not written out in single
    precision for all of x: descriptors have 2000 values a point.
    """

    @staticmethod
    def forward(context: Any, x: Tensor) -> Tensor:
        length = torch.linalg.vector_norm(x, dim=-1, keepdim=True, dtype=torch.float32)
        inverse = length.clamp_min(1e-12).reciprocal().to(x.dtype)
        unit = x * inverse
        context.save_for_backward(unit, inverse)
        return unit

    @staticmethod
    def backward(context: Any, *gradients: Tensor) -> Tensor:
        unit, inverse = context.saved_tensors
        gradient = gradients[0].to(unit.dtype)
        along = (gradient * unit).sum(dim=-1, keepdim=True)
        return torch.addcmul(gradient, unit, along, value=-1).mul_(inverse)


class ResidualBlock(nn.Module):
    """x + W2 relu(W1 relu(x)), with a linear shortcut where the width changes (…, width)."""

    def __init__(self, size: int, width: int) -> None:
        super().__init__()
        hidden = min(size, width)
        self.inner = nn.Linear(size, hidden)
        self.outer = nn.Linear(hidden, width)
        self.shortcut = nn.Identity() if size == width else nn.Linear(size, width, bias=False)
        nn.init.zeros_(self.outer.weight)

    def forward(self, x: Tensor, constant: Tensor | None = None) -> Tensor:
        """(b, n, width) of x (b, n, size), or of x and the rest of the block's input beside it,
        `constant` (b, 1, ·), which is the same at all n points."""
        if constant is None:
            hidden = self.inner(functional.relu(x)).relu_()
            return self.shortcut(x) + self.outer(hidden)
        assert isinstance(self.shortcut, nn.Linear)
        parts = [x.shape[-1], constant.shape[-1]]
        on_x, on_constant = self.inner.weight.split(parts, dim=1)
        rest = functional.linear(functional.relu(constant), on_constant, self.inner.bias)
        hidden = functional.linear(functional.relu(x), on_x).add_(rest).relu_()
        on_x, on_constant = self.shortcut.weight.split(parts, dim=1)
        return self.outer(hidden) + functional.linear(x, on_x).add_(
            functional.linear(constant, on_constant)
        )


class ResidualPointNet(nn.Module):
    """PointNet of residual blocks; between them each point sees the maximum over all points.

    As the point cloud encoder of Occupancy Networks (Mescheder et al., CVPR 2019).
    """

    def __init__(self, width: int, blocks: int) -> None:
        super().__init__()
        self.enter = nn.Linear(3, 2 * width)
        self.blocks = nn.ModuleList(ResidualBlock(2 * width, width) for _ in range(blocks))
        self.leave = nn.Linear(width, width)

    def forward(self, points: Tensor) -> Tensor:
        """(b, width) of points (b, n, 3)."""
        x = working_precision(exact_linear(points, self.enter.weight, self.enter.bias))
        pooled = None
        for block in self.blocks:
            x = block(x, pooled)
            pooled = x.amax(dim=1, keepdim=True)
        assert pooled is not None
        return self.leave(functional.relu(pooled.squeeze(1)))


class ConvolutionPointNet(nn.Module):
    """PointNet (Qi et al., CVPR 2017) without its transforms: 64-64-64-128-1024, 512, out.

    Batch normalisation after each convolution, as there; not after the two layers behind the
    pooling, because the third stage's batches hold two shapes.
    """

    def __init__(self, length: int) -> None:
        super().__init__()
        widths = (3, 64, 64, 64, 128, 1024)
        self.convolutions = nn.ModuleList(
            nn.Conv1d(size, width, 1) for size, width in pairwise(widths)
        )
        self.norms = nn.ModuleList(nn.BatchNorm1d(width) for width in widths[1:])
        self.middle = nn.Linear(widths[-1], 512)
        self.leave = nn.Linear(512, length)

    def forward(self, points: Tensor) -> Tensor:
        """(b, length) of points (b, n, 3)."""
        x = points.flatten(0, 1)
        for convolution, norm in zip(self.convolutions, self.norms, strict=True):
            assert isinstance(convolution, nn.Conv1d) and isinstance(norm, nn.BatchNorm1d)
            if norm is self.norms[-1]:
                pooled = _pooled_layer(x.unflatten(0, points.shape[:2]), convolution, norm)
            else:
                multiply = exact_linear if convolution.in_channels == 3 else functional.linear
                x = multiply(x, convolution.weight.squeeze(-1), convolution.bias)
                x = norm(working_precision(x)).relu_()
        return self.leave(functional.relu(self.middle(pooled)))


def _pooled_layer(x: Tensor, convolution: nn.Conv1d, norm: nn.BatchNorm1d) -> Tensor:
    """relu(norm(convolution(x))), its maximum over the points: (b, out) of x (b, n, in).

    Normalisation and relu rise with their input where the norm's weight is positive, and fall where
    it is negative: so the maximum is that of the convolution, or the minimum. Mean and variance of
    a linear layer follow from those of its input. So nothing but the points that win is needed in
    the backward pass, and no (b, n, out) is kept.
    """
    weight, bias = convolution.weight.squeeze(-1), convolution.bias
    assert bias is not None and norm.running_mean is not None and norm.running_var is not None
    with torch.no_grad():
        sign = torch.where(norm.weight < 0, -1.0, 1.0)
        signed = (sign[:, None] * weight).to(x.dtype)
        winner = torch.stack([(one @ signed.T).max(dim=0).indices for one in x])  # (b, out)
    with torch.autocast(x.device.type, enabled=False):
        rows = torch.arange(len(x), device=x.device)[:, None]
        won = (x[rows, winner].float() * weight).sum(-1) + bias
        if norm.training:
            flat = x.float().flatten(0, 1)
            centre = flat.mean(dim=0)
            covariance = (flat - centre).T @ (flat - centre) / len(flat)
            mean = weight @ centre + bias
            variance = ((weight @ covariance) * weight).sum(-1)
            _update(norm, mean, variance * len(flat) / max(1, len(flat) - 1))
        else:
            mean, variance = norm.running_mean, norm.running_var
        normal = (won - mean) * (variance + norm.eps).rsqrt()
        return functional.relu(normal * norm.weight + norm.bias)


@torch.no_grad()
def _update(norm: nn.BatchNorm1d, mean: Tensor, variance: Tensor) -> None:
    """Running mean and variance (c,), as the layer itself keeps them."""
    assert norm.running_mean is not None and norm.running_var is not None
    assert norm.momentum is not None and norm.num_batches_tracked is not None
    norm.running_mean.lerp_(mean, norm.momentum)
    norm.running_var.lerp_(variance, norm.momentum)
    norm.num_batches_tracked += 1
