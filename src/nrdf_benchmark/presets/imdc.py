"""The `imdc` preset: implicit functions for dense correspondence (Liu & Liu, NeurIPS 2020).

A PointNet embeds the shape, a branched implicit function gives each point a part embedding of 12
values whose largest is its occupancy, and an inverse implicit function maps the part embedding and
a shape's embedding back to a point. A rival that the benchmark trains and runs like ours.
"""

from __future__ import annotations

from typing import ClassVar

import torch
from torch import Tensor, nn
from torch.nn import functional

from nrdf.field.base import Field, FieldConfig, Inverse
from nrdf.field.point_nets import ConvolutionPointNet, exact_linear, working_precision

_SLOPE = 0.02  # of every leaky ReLU


class IMDCConfig(FieldConfig):
    """Sizes of IMDC's networks, as in its authors' released code."""

    encoder_points: int = 2048
    embedding_size: int = 256
    implicit_widths: tuple[int, int] = (3072, 384)
    branches: int = 12
    inverse_width: int = 512


class IMDCField(Field):
    """z (b, 256), k (b, m, 12) in [0, 1]: the part embedding; 4.6 million parameters.

    Normals are not used. The encoder is the one of the `paper` preset's convolutional half: that
    of IMDC's authors, but with batch normalisation, without which it learns little in few steps.
    """

    preset = "imdc"
    Config: ClassVar[type[FieldConfig]] = IMDCConfig
    config: IMDCConfig

    def __init__(self, config: IMDCConfig | None = None) -> None:
        super().__init__(config)
        self.encoder = ConvolutionPointNet(self.config.embedding_size)
        self.decoder = BranchedImplicit(self.config)
        self.inverse = InverseImplicit(self.config)

    def embed(self, points: Tensor, normals: Tensor) -> Tensor:
        return self.encoder(points)

    def occupancy(self, z: Tensor, queries: Tensor) -> Tensor:
        return self.decoder(z, queries).max(dim=-1).values

    def describe(self, z: Tensor, points: Tensor, normals: Tensor) -> Tensor:
        return self.decoder(z, points).sigmoid()

    def invert(self, z: Tensor, k: Tensor) -> Inverse:
        return Inverse(self.inverse(z, k))


class BranchedImplicit(nn.Module):
    """[z, p] → 3072 → 384 → one logit a branch; a point is inside where any branch says so."""

    def __init__(self, config: IMDCConfig) -> None:
        super().__init__()
        first, second = config.implicit_widths
        self.on_points = nn.Linear(3, first)
        self.on_z = nn.Linear(config.embedding_size, first, bias=False)
        self.middle = nn.Linear(first, second)
        self.leave = nn.Linear(second, config.branches)

    def forward(self, z: Tensor, points: Tensor) -> Tensor:
        """Logits (b, q, branches) at points (b, q, 3)."""
        x = exact_linear(points, self.on_points.weight, self.on_points.bias)
        x = working_precision(x) + self.on_z(z)[:, None]
        x = self.middle(functional.leaky_relu_(x, _SLOPE))
        # All that the inverse learns of a place is in these few values.
        x = functional.leaky_relu_(x, _SLOPE)
        return exact_linear(x, self.leave.weight, self.leave.bias)


class InverseImplicit(nn.Module):
    """[z, part embedding] → eight layers of 512, the fifth of which sees the input again → 3."""

    def __init__(self, config: IMDCConfig) -> None:
        super().__init__()
        width = config.inverse_width
        self.enter = _Conditioned(config.branches, config.embedding_size, width)
        self.before = nn.ModuleList(nn.Linear(width, width) for _ in range(3))
        self.again = _Conditioned(width + config.branches, config.embedding_size, width)
        self.after = nn.ModuleList(nn.Linear(width, width) for _ in range(2))
        self.leave = nn.Linear(width, 3)

    def forward(self, z: Tensor, k: Tensor) -> Tensor:
        """Points (b, m, 3) of part embeddings k (b, m, branches) on the shapes of z."""
        x = exact_linear(k, self.enter.on_x.weight, self.enter.on_x.bias)
        x = functional.leaky_relu_(working_precision(x) + self.enter.on_z(z)[:, None], _SLOPE)
        for layer in self.before:
            x = functional.leaky_relu_(layer(x), _SLOPE)
        x = self.again(torch.cat([x, k.to(x.dtype)], dim=-1), z)
        x = functional.leaky_relu_(x, _SLOPE)
        for layer in self.after:
            x = functional.leaky_relu_(layer(x), _SLOPE)
        return exact_linear(x, self.leave.weight, self.leave.bias).tanh()


class _Conditioned(nn.Module):
    """A linear layer on [x, z], the part that z has in it computed once for each shape."""

    def __init__(self, size: int, embedding: int, width: int) -> None:
        super().__init__()
        self.on_x = nn.Linear(size, width)
        self.on_z = nn.Linear(embedding, width, bias=False)

    def forward(self, x: Tensor, z: Tensor) -> Tensor:
        return self.on_x(x) + self.on_z(z)[:, None]
