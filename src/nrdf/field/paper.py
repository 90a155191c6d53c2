"""The `paper` preset: the network of the NRDF paper, with the sizes of its released training code.

A embeds the shape by two PointNets side by side, B is the occupancy decoder whose activations are
the descriptor θ, C maps a descriptor and the target's embedding to a point of the target.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

import torch
from torch import Tensor, nn
from torch.nn import functional

from nrdf.field.base import Field, FieldConfig, Inverse
from nrdf.field.point_nets import (
    ConvolutionPointNet,
    ResidualBlock,
    ResidualPointNet,
    UnitLength,
    exact_linear,
    working_precision,
)

_POINT_GAIN = 20.0
"""How much larger the weights of point features beside z start in B than torch starts them. As it
does, 32 values of 0.2 drown in 384 of z, and B learns one mean shape for thousands of steps."""


class PaperConfig(FieldConfig):
    """Sizes of the paper's network."""

    encoder_points: int = 8192
    point_scale: float = 10.0
    """Points are multiplied by this before the encoders."""
    residual_size: int = 128
    """Length of the residual PointNet's part of z, and the width of its blocks."""
    residual_blocks: int = 5
    convolution_size: int = 256
    """Length of the convolutional PointNet's part of z."""
    point_features: int = 32
    decoder_width: int = 256
    decoder_blocks: int = 5
    inverse_widths: tuple[int, int, int] = (1024, 512, 256)

    @property
    def embedding_size(self) -> int:
        """Length of z: 384."""
        return self.residual_size + self.convolution_size

    @property
    def activation_size(self) -> int:
        """Length of what B computes at a point: 1537."""
        return self.decoder_width * (1 + self.decoder_blocks) + 1

    @property
    def descriptor_size(self) -> int:
        """Length of k: 1953."""
        return self.point_features + self.embedding_size + self.activation_size


class PaperField(Field):
    """z (b, 384), k (b, m, 1953) of unit length; 6.2 million parameters. Normals are not used."""

    preset = "paper"
    Config: ClassVar[type[FieldConfig]] = PaperConfig
    config: PaperConfig

    def __init__(self, config: PaperConfig | None = None) -> None:
        super().__init__(config)
        self.encoder = Encoder(self.config)
        self.decoder = Decoder(self.config)
        self.inverse = InverseDescriptor(self.config)

    def embed(self, points: Tensor, normals: Tensor) -> Tensor:
        return self.encoder(points)

    def occupancy(self, z: Tensor, queries: Tensor) -> Tensor:
        return self.decoder.logit(z, queries)

    def describe(self, z: Tensor, points: Tensor, normals: Tensor) -> Tensor:
        """k = [point features, z, activations of B, logit], of unit length (b, m, 1953)."""
        features, activations = self.decoder(z, points)
        constant = z[:, None].expand(-1, points.shape[1], -1).to(features.dtype)
        raw = torch.cat([features, constant, activations], dim=-1)
        return UnitLength.apply(raw)  # type: ignore[no-any-return]

    def invert(self, z: Tensor, k: Tensor) -> Inverse:
        return self.invert_prepared(z, self.prepare(k))

    def prepare(self, k: Tensor) -> Tensor:
        return self.inverse.on_descriptor(k)

    def invert_prepared(self, z: Tensor, prepared: Tensor) -> Inverse:
        return Inverse(self.inverse(z, prepared))

    def transfer(
        self, z_reference: Tensor, points: Tensor, normals: Tensor, z_target: Tensor
    ) -> Inverse:
        features, activations = self.decoder(z_reference, points)
        return Inverse(self.inverse.from_parts(z_target, z_reference, features, activations))


class Encoder(nn.Module):
    """A: the residual PointNet's and the convolutional PointNet's features, side by side."""

    def __init__(self, config: PaperConfig) -> None:
        super().__init__()
        self.point_scale = config.point_scale
        self.residual = ResidualPointNet(config.residual_size, config.residual_blocks)
        self.convolution = ConvolutionPointNet(config.convolution_size)

    def forward(self, points: Tensor) -> Tensor:
        """z (b, 384) of points (b, n, 3)."""
        points = self.point_scale * points
        return torch.cat([self.residual(points), self.convolution(points)], dim=-1)


class Decoder(nn.Module):
    """B: occupancy from a point's 32 features beside z, through 5 residual blocks of 256."""

    def __init__(self, config: PaperConfig) -> None:
        super().__init__()
        width = config.decoder_width
        self.lift = nn.Linear(3, config.point_features)
        self.enter = nn.Linear(config.point_features + config.embedding_size, width)
        self.blocks = nn.ModuleList(
            ResidualBlock(width, width) for _ in range(config.decoder_blocks)
        )
        self.leave = nn.Linear(width, 1)
        with torch.no_grad():
            self.enter.weight[:, : config.point_features] *= _POINT_GAIN

    def forward(self, z: Tensor, points: Tensor) -> tuple[Tensor, Tensor]:
        """Point features (b, q, 32) and activations (b, q, 1537), whose last is the logit."""
        features = exact_linear(points, self.lift.weight, self.lift.bias)
        layers = list(self._layers(z, points))
        return working_precision(features), torch.cat([*layers, self._logit(layers[-1])], dim=-1)

    def logit(self, z: Tensor, points: Tensor) -> Tensor:
        """The logits (b, q) alone: nothing is kept of the layers before."""
        for layer in self._layers(z, points):
            x = layer
        return self._logit(x)[..., 0]

    def _logit(self, x: Tensor) -> Tensor:
        return self.leave(functional.relu(x))

    def _layers(self, z: Tensor, points: Tensor) -> Iterator[Tensor]:
        """What the first layer and every block make of points (b, q, 3): (b, q, 256) each."""
        # W [F p + f, z] = (W_f F) p + W_f f + W_z z: the last two once for each object.
        on_features, on_z = self.enter.weight.split([self.lift.out_features, z.shape[-1]], dim=1)
        constant = exact_linear(z, on_z, self.enter.bias)
        constant = constant + exact_linear(self.lift.bias, on_features)
        with torch.autocast(points.device.type, enabled=False):
            on_points = on_features @ self.lift.weight
        x = working_precision(exact_linear(points, on_points) + constant[:, None])
        yield x
        for block in self.blocks:
            x = block(x)
            yield x


class InverseDescriptor(nn.Module):
    """C: [z, k] (2337) → 1024 → 512 → 256 → 256 → 3, tanh."""

    def __init__(self, config: PaperConfig) -> None:
        super().__init__()
        first, second, third = config.inverse_widths
        self.config = config
        self.enter = nn.Linear(config.embedding_size + config.descriptor_size, first)
        self.blocks = nn.ModuleList(
            [
                ResidualBlock(first, second),
                ResidualBlock(second, third),
                ResidualBlock(third, third),
            ]
        )
        self.leave = nn.Linear(third, 3)

    def on_descriptor(self, k: Tensor) -> Tensor:
        """The share of descriptors k (b, m, 1953) in the first layer (b, m, 1024): the same for
        every target."""
        return functional.linear(k, self.enter.weight[:, -k.shape[-1] :])

    def forward(self, z: Tensor, on_k: Tensor) -> Tensor:
        """Points (b, m, 3) on the targets of z (b, 384), of what `on_descriptor` gives."""
        constant = functional.linear(z, self.enter.weight[:, : z.shape[-1]], self.enter.bias)
        return self._rest(on_k + constant[:, None])

    def from_parts(
        self, z_target: Tensor, z_reference: Tensor, features: Tensor, activations: Tensor
    ) -> Tensor:
        """The same from what a descriptor is made of, before it is scaled to unit length.

        Of the 2337 inputs 768 are constant for a pair of objects, but for the descriptor's length:
        their share of the first layer is computed once and scaled for each point.
        """
        config = self.config
        on_target, on_features, on_reference, on_activations = self.enter.weight.split(
            [
                config.embedding_size,
                config.point_features,
                config.embedding_size,
                config.activation_size,
            ],
            dim=1,
        )
        square = (
            features.float().square().sum(-1, keepdim=True)
            + activations.float().square().sum(-1, keepdim=True)
            + z_reference.float().square().sum(-1)[:, None, None]
        )
        x = functional.linear(activations, on_activations)
        x = x + functional.linear(features, on_features)
        x = x + functional.linear(z_reference, on_reference)[:, None]
        constant = functional.linear(z_target, on_target, self.enter.bias)
        return self._rest(x * square.clamp_min(1e-24).rsqrt().to(x.dtype) + constant[:, None])

    def _rest(self, x: Tensor) -> Tensor:
        for block in self.blocks:
            x = block(x)
        x = functional.leaky_relu(x, 0.02)
        return exact_linear(x, self.leave.weight, self.leave.bias).tanh()
