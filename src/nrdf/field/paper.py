"""The `paper` preset: the network of the NRDF paper, with the sizes of its released training code.

A embeds the shape by two PointNets side by side, B is the occupancy decoder whose activations are
the descriptor θ, C maps a descriptor and the target's embedding to a point of the target.
"""

from __future__ import annotations

from itertools import pairwise
from typing import ClassVar

import torch
from torch import Tensor, nn
from torch.nn import functional

from nrdf.field.base import Field, FieldConfig, Inverse


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
        return self.decoder(z, queries)[1][..., -1]

    def describe(self, z: Tensor, points: Tensor, normals: Tensor) -> Tensor:
        """k = [point features, z, activations of B, logit], of unit length (b, m, 1953)."""
        features, activations = self.decoder(z, points)
        constant = z[:, None].expand(-1, points.shape[1], -1).to(features.dtype)
        return functional.normalize(torch.cat([features, constant, activations], dim=-1), dim=-1)

    def invert(self, z: Tensor, k: Tensor) -> Inverse:
        return Inverse(self.inverse(z, k))

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
        x = self.enter(points)
        pooled = x
        for number, block in enumerate(self.blocks):
            if number:
                x = torch.cat([x, pooled.expand_as(x)], dim=-1)
            x = block(x)
            pooled = x.max(dim=1, keepdim=True).values
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
        x = points.transpose(1, 2)
        for convolution, norm in zip(self.convolutions, self.norms, strict=True):
            x = functional.relu(norm(convolution(x)))
        return self.leave(functional.relu(self.middle(x.max(dim=2).values)))


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

    def forward(self, z: Tensor, points: Tensor) -> tuple[Tensor, Tensor]:
        """Point features (b, q, 32) and activations (b, q, 1537), whose last is the logit."""
        features = self.lift(points)
        # [features, z] times the weights, the part that z has in it once for each object.
        on_features, on_z = self.enter.weight.split([features.shape[-1], z.shape[-1]], dim=1)
        x = functional.linear(features, on_features, self.enter.bias)
        x = x + functional.linear(z, on_z)[:, None]
        activations = [x]
        for block in self.blocks:
            x = block(x)
            activations.append(x)
        activations.append(self.leave(functional.relu(x)))
        return features, torch.cat(activations, dim=-1)


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

    def forward(self, z: Tensor, k: Tensor) -> Tensor:
        """Points (b, m, 3) on the targets of z (b, 384) for descriptors k (b, m, 1953)."""
        on_z, on_k = self.enter.weight.split([z.shape[-1], k.shape[-1]], dim=1)
        constant = functional.linear(z, on_z, self.enter.bias)
        return self._rest(functional.linear(k, on_k) + constant[:, None])

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
        return self.leave(functional.leaky_relu(x, 0.02)).tanh()


class ResidualBlock(nn.Module):
    """x + W2 relu(W1 relu(x)), with a linear shortcut where the width changes (…, width)."""

    def __init__(self, size: int, width: int) -> None:
        super().__init__()
        hidden = min(size, width)
        self.inner = nn.Linear(size, hidden)
        self.outer = nn.Linear(hidden, width)
        self.shortcut = nn.Identity() if size == width else nn.Linear(size, width, bias=False)
        nn.init.zeros_(self.outer.weight)

    def forward(self, x: Tensor) -> Tensor:
        return self.shortcut(x) + self.outer(functional.relu(self.inner(functional.relu(x))))
