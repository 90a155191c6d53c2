"""The `default` preset: oriented descriptors, a box-aligned start and a local refinement.

It keeps the paper's three parts (encoder A, occupancy decoder B whose activations are the
descriptor, inverse C) and changes what was measured to matter:

- the encoder sees normals, normalises its pooled feature across the batch (training does not
  stall), and keeps local features of the shape on three axis-aligned feature planes beside the
  global latent (planes as in Convolutional Occupancy Networks, Peng et al., ECCV 2020);
- the descriptor of a point carries its normal, so that the two sides of a thin part differ;
- B's occupancy is only what descriptors are made of. The occupancy that the field tells comes from
  the cloud's own points near the place (`nrdf.field.local_occupancy`): one code for a whole shape
  leaves thin parts in doubt;
- C predicts a displacement from half-way between the reference point and its copy in the target's
  bounding box (coarse), then samples the target's local features there and corrects itself once
  (refine). It is one forward pass: nothing is optimised for a pair.
"""

from __future__ import annotations

import math
from typing import ClassVar

import torch
from torch import Tensor, nn
from torch.nn import functional

from nrdf.field.base import Field, FieldConfig, Inverse
from nrdf.field.local_occupancy import LocalOccupancy, Width, points_behind, with_points

_PLANE_AXES = ((0, 1), (1, 2), (2, 0))
_PLANE_SIDE = 1.1  # canonical side that a plane covers: the unit box and a margin


class DefaultConfig(FieldConfig):
    """Sizes of the default preset."""

    encoder_points: int = 1024
    latent: int = 256
    """Length of the global part of the embedding."""
    point_features: int = 384
    """Width of the pooled point features."""
    plane_channels: int = 24
    plane_cells: int = 24
    plane_layers: int = 3
    octaves: int = 3
    """Octaves of the positional encoding."""
    decoder_width: int = 128
    decoder_blocks: int = 2
    occupancy_width: Width = 64
    """Width of what tells occupancy by the points nearby."""
    inverse_width: int = 192
    inverse_blocks: int = 2
    refine_blocks: int = 2


class DefaultField(Field):
    """Embedding z = [latent, extents of the bounding box (3), feature planes, the points that the
    encoder saw with their normals], flattened."""

    preset = "default"
    Config: ClassVar[type[FieldConfig]] = DefaultConfig
    config: DefaultConfig

    def __init__(self, config: DefaultConfig | None = None) -> None:
        super().__init__(config)
        self.encoder = Encoder(self.config)
        self.decoder = Decoder(self.config)
        self.inverse = InverseDescriptor(self.config, self.decoder.descriptor_size)
        self.local_occupancy = LocalOccupancy(self.config.occupancy_width)

    def embed(self, points: Tensor, normals: Tensor) -> Tensor:
        return with_points(self.encoder(points, normals), points, normals)

    def occupancy(self, z: Tensor, queries: Tensor) -> Tensor:
        return self.local_occupancy(queries, *points_behind(z, self._coded))

    def coarse_occupancy(self, z: Tensor, queries: Tensor) -> Tensor:
        latent, _, planes = self._split(z)
        return self.decoder(latent, sample_planes(planes, queries), queries)[1]

    def describe(self, z: Tensor, points: Tensor, normals: Tensor) -> Tensor:
        """k = [activations of B, point, point relative to the bounding box, normal]."""
        latent, extents, planes = self._split(z)
        activations, _ = self.decoder(latent, sample_planes(planes, points), points)
        relative = points / extents[:, None]
        return torch.cat([activations, points, relative, normals], dim=-1)

    def invert(self, z: Tensor, k: Tensor) -> Inverse:
        latent, extents, planes = self._split(z)
        return self.inverse(latent, extents, planes, k)

    def _split(self, z: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        config = self.config
        cells = config.plane_cells
        sizes = [config.latent, 3, self._coded - config.latent - 3]
        latent, extents, planes = z[:, : self._coded].split(sizes, dim=1)
        return latent, extents, planes.unflatten(1, (3, config.plane_channels, cells, cells))

    @property
    def _coded(self) -> int:
        """Length of z before the points."""
        config = self.config
        return config.latent + 3 + 3 * config.plane_channels * config.plane_cells**2


class Encoder(nn.Module):
    """A: a PointNet for the global latent, and feature planes for what is local."""

    def __init__(self, config: DefaultConfig) -> None:
        super().__init__()
        self.config = config
        channels = config.plane_channels
        self.lift = nn.Sequential(nn.Linear(6, 64), nn.ReLU(), nn.Linear(64, 128), nn.ReLU())
        self.widen = nn.Linear(128, config.point_features)
        self.normalise = nn.BatchNorm1d(config.point_features)
        self.compress = nn.Sequential(
            nn.Linear(config.point_features, config.latent),
            nn.ReLU(),
            nn.Linear(config.latent, config.latent),
        )
        self.local = nn.Linear(128, channels)
        self.context = nn.Linear(config.latent, 3 * channels)
        self.layers = nn.ModuleList(
            nn.Conv2d(channels, channels, 3, padding=1) for _ in range(config.plane_layers)
        )

    def forward(self, points: Tensor, normals: Tensor) -> Tensor:
        features = self.lift(torch.cat([10 * points, normals], dim=-1))
        # max(dim) keeps the indices; amax would spread its gradient over ties, slowly.
        pooled = self.widen(features).max(dim=1)[0]
        latent = self.compress(self.normalise(pooled))
        extents = points.amax(1) - points.amin(1)
        planes = self._planes(points, self.local(features), latent)
        return torch.cat([latent, extents.clamp_min(1e-3), planes.flatten(1)], dim=1)

    def _planes(self, points: Tensor, features: Tensor, latent: Tensor) -> Tensor:
        """Mean point feature in each cell of each plane, then convolutions, (b, 3, c, r, r)."""
        cells, channels = self.config.plane_cells, self.config.plane_channels
        batch = len(points)
        cell = ((points / _PLANE_SIDE + 0.5) * cells).long().clamp(0, cells - 1)
        offset = torch.arange(batch, device=points.device)[:, None] * cells * cells
        with_count = torch.cat([features, torch.ones_like(features[..., :1])], dim=-1).flatten(0, 1)
        planes = []
        for row, column in _PLANE_AXES:
            index = (offset + cell[..., row] * cells + cell[..., column]).flatten()
            sums = with_count.new_zeros(batch * cells * cells, channels + 1)
            sums = sums.index_add(0, index, with_count)
            planes.append(sums[:, :-1] / sums[:, -1:].clamp_min(1))
        grid = torch.stack(planes, 1).view(batch, cells, cells, 3, channels)
        grid = grid.permute(0, 3, 4, 1, 2) + self.context(latent).view(batch, 3, channels, 1, 1)
        grid = grid.flatten(0, 1)
        for layer in self.layers:
            grid = grid + layer(functional.relu(grid))
        return grid.unflatten(0, (batch, 3))


class Decoder(nn.Module):
    """B: occupancy logits of points, and the activations that describe them."""

    def __init__(self, config: DefaultConfig) -> None:
        super().__init__()
        width, self.octaves = config.decoder_width, config.octaves
        encoded = encoded_size(config.octaves) + 3 * config.plane_channels
        self.enter = nn.Linear(encoded, width)
        self.condition = nn.Linear(config.latent, width)
        self.blocks = nn.ModuleList(ResidualBlock(width) for _ in range(config.decoder_blocks))
        self.leave = nn.Linear(width, 1)
        self.activations = width * (1 + config.decoder_blocks) + 1
        self.descriptor_size = self.activations + 9

    def forward(self, latent: Tensor, local: Tensor, points: Tensor) -> tuple[Tensor, Tensor]:
        """Activations (b, q, activations) and logits (b, q) at points (b, q, 3)."""
        x = self.enter(torch.cat([positional_encoding(points, self.octaves), local], dim=-1))
        x = x + self.condition(latent)[:, None]
        activations = [functional.relu(x)]
        for block in self.blocks:
            x = block(x)
            activations.append(functional.relu(x))
        logits = self.leave(activations[-1])
        return torch.cat([*activations, logits], dim=-1), logits[..., 0]


class InverseDescriptor(nn.Module):
    """C: displacement from the half-way copy, then one correction by the features found there."""

    def __init__(self, config: DefaultConfig, descriptor_size: int) -> None:
        super().__init__()
        width, self.octaves = config.inverse_width, config.octaves
        encoded = encoded_size(config.octaves)
        self.enter = nn.Linear(descriptor_size - 6 + 2 * encoded, width)
        self.condition = nn.Linear(config.latent, width)
        self.blocks = nn.ModuleList(ResidualBlock(width) for _ in range(config.inverse_blocks))
        self.leave = nn.Linear(width, 8)
        self.refine = nn.Linear(width + 3 * config.plane_channels + encoded, width)
        self.refine_blocks = nn.ModuleList(
            ResidualBlock(width) for _ in range(config.refine_blocks)
        )
        self.correct = nn.Linear(width, 8)
        for layer in (self.leave, self.correct):
            nn.init.zeros_(layer.weight)
            nn.init.zeros_(layer.bias)

    def forward(self, latent: Tensor, extents: Tensor, planes: Tensor, k: Tensor) -> Inverse:
        activations, points, relative, normals = k.split([k.shape[-1] - 9, 3, 3, 3], dim=-1)
        box_copy = relative * extents[:, None]
        encoded = [positional_encoding(p, self.octaves) for p in (points, box_copy)]
        x = self.enter(torch.cat([activations, *encoded, normals], dim=-1))
        x = x + self.condition(latent)[:, None]
        for block in self.blocks:
            x = block(x)
        x = functional.relu(x)
        coarse = self.leave(x)
        coarse_points = (points + box_copy) / 2 + coarse[..., :3]
        # Where local features are sampled is not learned through the sampling: steadier, cheaper.
        at = coarse_points.detach()
        local = [sample_planes(planes, at), positional_encoding(at, self.octaves)]
        x = self.refine(torch.cat([x, *local], dim=-1))
        for block in self.refine_blocks:
            x = block(x)
        refined = self.correct(functional.relu(x))
        outward = normals + coarse[..., 3:6] + refined[..., 3:6]
        return Inverse(
            points=coarse_points + refined[..., :3],
            normals=functional.normalize(outward, dim=-1),
            existence=coarse[..., 6] + refined[..., 6] + 3.0,
            log_error=coarse[..., 7] + refined[..., 7] - 3.0,
            coarse_points=coarse_points,
        )


class ResidualBlock(nn.Module):
    """x + W2 relu(W1 relu(x)), starting as the identity (b, m, width)."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.inner = nn.Linear(width, width)
        self.outer = nn.Linear(width, width)
        nn.init.zeros_(self.outer.weight)
        nn.init.zeros_(self.outer.bias)

    def forward(self, x: Tensor) -> Tensor:
        return x + self.outer(functional.relu(self.inner(functional.relu(x))))


def encoded_size(octaves: int) -> int:
    """Length of the positional encoding of a point."""
    return 3 * (1 + 2 * octaves)


def positional_encoding(points: Tensor, octaves: int) -> Tensor:
    """[p, sin(2^i π p), cos(2^i π p)] of points (…, 3), (…, 3 (1 + 2 octaves))."""
    parts = [points]
    for octave in range(octaves):
        angle = points * (2**octave * math.pi)
        parts += [torch.sin(angle), torch.cos(angle)]
    return torch.cat(parts, dim=-1)


def sample_planes(planes: Tensor, points: Tensor) -> Tensor:
    """Features (b, m, 3c) of planes (b, 3, c, r, r) at points (b, m, 3), bilinear."""
    scaled = points * (2 / _PLANE_SIDE)
    # grid_sample wants (column, row).
    places = torch.stack([scaled[..., [column, row]] for row, column in _PLANE_AXES], dim=1)
    features = functional.grid_sample(
        planes.flatten(0, 1),
        places.flatten(0, 1)[:, :, None],
        padding_mode="border",
        align_corners=False,
    )
    return features[..., 0].unflatten(0, planes.shape[:2]).flatten(1, 2).transpose(1, 2)
