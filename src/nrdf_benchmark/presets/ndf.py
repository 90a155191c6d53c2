"""The `ndf` preset: Neural Descriptor Fields (Simeonov et al., ICRA 2022).

A vector-neuron PointNet (Deng et al., ICCV 2021) embeds the shape as 256 vectors that turn with
it; an occupancy decoder sees a point through its inner products with them, and its activations are
the descriptor. So descriptors do not change when shape and point are turned or moved together.
There is no inverse descriptor function; `nrdf_benchmark.methods.ndf_search` searches the target's
points instead.
"""

from __future__ import annotations

from typing import ClassVar, NoReturn

import torch
from torch import Tensor, nn
from torch.nn import functional

from nrdf.errors import ModelError
from nrdf.field.base import Field, FieldConfig

_SLOPE = 0.2  # of every leaky ReLU
_EPS = 1e-6


class NDFConfig(FieldConfig):
    """Sizes of NDF's networks; the encoder's are those of its authors' released code."""

    encoder_points: int = 1024
    centres: int = 1024
    """Encoder points whose features go through the network; all are seen as their neighbours."""
    neighbours: int = 20
    """Nearest points (itself among them) from which a centre's first features are averaged."""
    edge_channels: int = 128
    """Vectors of these first features."""
    hidden: int = 128
    """Vectors of a point's features behind each residual block."""
    encoder_blocks: int = 5
    latent: int = 256
    """Vectors of the embedding."""
    point_scale: float = 10.0
    """Points are multiplied by this before encoder and decoder."""
    decoder_width: int = 128
    decoder_blocks: int = 5

    @property
    def descriptor_size(self) -> int:
        """Length of k: 769."""
        return self.decoder_width * (1 + self.decoder_blocks) + 1


class NDFField(Field):
    """z (b, 771), k (b, m, 769) of unit length. Normals are not used.

    z is 256 vectors and the mean of the points, to which everything is relative, flattened: turning
    and moving a cloud turns the vectors and moves the mean, and nothing else. Turning needs no
    augmentation, but nothing tells a field that cannot see which way is up that it matters.
    """

    preset = "ndf"
    inverts = False
    Config: ClassVar[type[FieldConfig]] = NDFConfig
    config: NDFConfig

    def __init__(self, config: NDFConfig | None = None) -> None:
        super().__init__(config)
        self.encoder = VectorPointNet(self.config)
        self.decoder = Decoder(self.config)

    def embed(self, points: Tensor, normals: Tensor) -> Tensor:
        centre = points.mean(dim=1, keepdim=True)
        vectors = self.encoder(self.config.point_scale * (points - centre))
        return torch.cat([vectors, centre], dim=1).flatten(1)

    def occupancy(self, z: Tensor, queries: Tensor) -> Tensor:
        return self._activations(z, queries)[-1][..., 0]

    def describe(self, z: Tensor, points: Tensor, normals: Tensor) -> Tensor:
        """k = [first layer, every block, logit], of unit length (b, m, 769)."""
        return functional.normalize(torch.cat(self._activations(z, points), dim=-1), dim=-1)

    def invert(self, z: Tensor, k: Tensor) -> NoReturn:
        """Raises ModelError: NDF has no inverse descriptor function."""
        raise ModelError(
            f"preset '{self.preset}' has no inverse descriptor function, so it retrieves no "
            "regions and trains on occupancy alone; use `nrdf eval bsrc --method ndf` to search "
            "with it, or a model of preset 'default'"
        )

    def _activations(self, z: Tensor, points: Tensor) -> list[Tensor]:
        vectors, centre = z.unflatten(1, (-1, 3)).split([self.config.latent, 1], dim=1)
        return self.decoder(vectors, self.config.point_scale * (points - centre))


class VectorPointNet(nn.Module):
    """Residual PointNet of vector neurons, as NDF's: each channel of a feature is a vector."""

    def __init__(self, config: NDFConfig) -> None:
        super().__init__()
        self.config = config
        hidden = config.hidden
        # A point's position alone would leave all vectors parallel: no direction to turn from.
        self.edge = nn.Linear(3, config.edge_channels, bias=False)
        self.edge_relu = VectorReLU(config.edge_channels)
        self.enter = nn.Linear(config.edge_channels, 2 * hidden, bias=False)
        self.blocks = nn.ModuleList(
            VectorBlock(2 * hidden, hidden) for _ in range(config.encoder_blocks)
        )
        self.relu = VectorReLU(hidden)
        self.leave = nn.Linear(hidden, config.latent, bias=False)

    def forward(self, points: Tensor) -> Tensor:
        """Vectors (b, latent, 3) of points (b, n, 3)."""
        x = self.enter(self.edge_relu(self.edge(self._edges(points))).mean(dim=2))
        pooled = x
        for number, block in enumerate(self.blocks):
            if number:
                x = torch.cat([x, pooled.expand_as(x)], dim=-1)
            x = block(x)
            pooled = x.mean(dim=1, keepdim=True)
        return self.leave(self.relu(pooled.squeeze(1))).transpose(1, 2)

    def _edges(self, points: Tensor) -> Tensor:
        """(b, c, k, 3, 3): for each neighbour of a centre the offset to it, the centre, and the
        cross product of the two positions, which tells left from right; vectors second to last."""
        config, (batch, count, _) = self.config, points.shape
        step = max(1.0, count / config.centres)
        chosen = (torch.arange(min(count, config.centres), device=points.device) * step).long()
        centres = points[:, chosen]
        with torch.no_grad():
            apart = torch.cdist(
                centres.float(), points.float(), compute_mode="donot_use_mm_for_euclid_dist"
            )
            near = apart.topk(min(config.neighbours, count), dim=2, largest=False).indices
        rows = torch.arange(batch, device=points.device)[:, None, None]
        around = points[rows, near]
        centres = centres[:, :, None].expand_as(around)
        cross = torch.linalg.cross(around, centres)
        return torch.stack([around - centres, centres, cross], dim=-1)


class VectorReLU(nn.Module):
    """Leaky ReLU of vectors (..., 3, c): the part against a learned direction is damped."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.direction = nn.Linear(channels, channels, bias=False)

    def forward(self, x: Tensor) -> Tensor:
        d = self.direction(x)
        along = (x * d).sum(dim=-2, keepdim=True).clamp_max(0)
        against = (1 - _SLOPE) * along / (d.square().sum(dim=-2, keepdim=True) + _EPS)
        return torch.addcmul(x, against, d, value=-1)


class VectorBlock(nn.Module):
    """S x + W2 relu(W1 relu(x)) of vectors (..., 3, size) to (..., 3, width)."""

    def __init__(self, size: int, width: int) -> None:
        super().__init__()
        self.first, self.second = VectorReLU(size), VectorReLU(width)
        self.inner = nn.Linear(size, width, bias=False)
        self.outer = nn.Linear(width, width, bias=False)
        self.shortcut = nn.Linear(size, width, bias=False)
        nn.init.zeros_(self.outer.weight)

    def forward(self, x: Tensor) -> Tensor:
        return self.shortcut(x) + self.outer(self.second(self.inner(self.first(x))))


class Decoder(nn.Module):
    """Occupancy from what does not turn: ⟨z_i, p⟩ and ⟨z_i, (V z)_i⟩ of each channel, and ‖p‖²."""

    def __init__(self, config: NDFConfig) -> None:
        super().__init__()
        width = config.decoder_width
        self.direction = nn.Linear(config.latent, config.latent, bias=False)
        self.enter = nn.Linear(2 * config.latent + 1, width)
        self.blocks = nn.ModuleList(ResidualBlock(width) for _ in range(config.decoder_blocks))
        self.leave = nn.Linear(width, 1)

    def forward(self, vectors: Tensor, points: Tensor) -> list[Tensor]:
        """Activations (b, q, width) of every layer and logits (b, q, 1), of vectors (b, latent, 3)
        and points (b, q, 3)."""
        # In full precision: a point in bfloat16 is off by a hundredth of its size.
        with torch.autocast(points.device.type, enabled=False):
            vectors, points = vectors.float(), points.float()
            turned = self.direction(vectors.transpose(1, 2)).transpose(1, 2)
            invariant = (vectors * turned).sum(dim=-1)
            latent = vectors.shape[1]
            on_product, on_invariant, on_square = self.enter.weight.split([latent, latent, 1], 1)
            # W ⟨z, p⟩ is (W z) p, and W ⟨z, V z⟩ is one vector: both once for each shape.
            constant = functional.linear(invariant, on_invariant, self.enter.bias)
            x = points @ (on_product @ vectors).transpose(1, 2) + constant[:, None]
            x = x + points.square().sum(dim=-1, keepdim=True) * on_square[:, 0]
        activations = [x]
        for block in self.blocks:
            x = block(x)
            activations.append(x)
        activations.append(self.leave(functional.leaky_relu(x, _SLOPE)))
        return activations


class ResidualBlock(nn.Module):
    """x + W2 relu(W1 relu(x)), leaky, starting as the identity (b, q, width)."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.inner = nn.Linear(width, width)
        self.outer = nn.Linear(width, width)
        nn.init.zeros_(self.outer.weight)

    def forward(self, x: Tensor) -> Tensor:
        hidden = self.inner(functional.leaky_relu(x, _SLOPE))
        return x + self.outer(functional.leaky_relu(hidden, _SLOPE))
