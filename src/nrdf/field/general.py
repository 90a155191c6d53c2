"""The `general` preset: one field for objects of every kind, which need not have been trained on.

The paper's parts, for pairs of shapes of any kind:

- the encoder A makes of a shape a *set* of local tokens instead of one code (`nrdf.field.tokens`):
  what is around a place is alike on kinds that are not;
- the descriptor of a point is what the tokens around it have become after they have seen their own
  shape and the other one (self- and cross-attention: Vaswani et al. 2017; as for correspondences
  in LightGlue, Lindenberger et al., ICCV 2023). So it belongs to a pair, not to a shape;
- C finds the place of every token on the other shape in several looks. Each look is a step of a
  registration whose matches are learned: a soft assignment to the other shape's tokens, which
  prefers those near the place of the look before and facing the same way, and an offset. Other
  points move as the tokens around them do.

Nothing is optimised for a pair; `nrdf.regions.registration_mapper` does a few steps of that
afterwards, because the tokens are 0.05 apart. Occupancy comes from the points near a place
(`nrdf.field.local_occupancy`).
"""

from __future__ import annotations

from typing import ClassVar, Final, NamedTuple, NoReturn

import torch
from torch import Tensor, nn

from nrdf.errors import ModelError
from nrdf.field.base import Field, FieldConfig, Inverse
from nrdf.field.local_occupancy import LocalOccupancy, Width, points_behind, with_points
from nrdf.field.pair_inverse import PairInverse, Places, Tokens, half_way
from nrdf.field.tokens import GEOMETRY, farthest_points, gather, squared_distances, surroundings

GENERAL: Final = "general"
"""Name of the model in the zoo, wherever a model is named, and its preset."""

_POINT_FEATURES = 96  # of each scale
_BETWEEN = 6  # tokens that a point moves with
_NORMAL_WEIGHT = 0.1  # of the distance to them
_SMOOTHING = 0.02  # canonical length added to the nearest one's distance


class GeneralConfig(FieldConfig):
    """Sizes of the general preset."""

    encoder_points: int = 1024
    tokens: int = 192
    width: int = 128
    heads: int = 4
    looks: int = 5
    """Blocks of self- and cross-attention."""
    occupancy_width: Width = 64
    """Width of what tells occupancy."""


class GeneralField(Field):
    """Embedding z = the tokens' points, normals and features, the bounding box, and the points that
    the encoder saw with their normals, flattened."""

    preset = GENERAL
    inverts = False
    Config: ClassVar[type[FieldConfig]] = GeneralConfig
    config: GeneralConfig

    def __init__(self, config: GeneralConfig | None = None) -> None:
        super().__init__(config)
        self.encoder = TokenEncoder()
        sizes = self.config
        self.inverse = PairInverse(2 * _POINT_FEATURES, sizes.width, sizes.heads, sizes.looks)
        self.local_occupancy = LocalOccupancy(sizes.occupancy_width)

    def embed(self, points: Tensor, normals: Tensor) -> Tensor:
        order = torch.randperm(points.shape[1], generator=torch.Generator().manual_seed(0))
        points, normals = points[:, order.to(points.device)], normals[:, order.to(points.device)]
        chosen = farthest_points(points, self.config.tokens)
        return with_points(pack(self.encoder(points, normals, chosen)), points, normals)

    def occupancy(self, z: Tensor, queries: Tensor) -> Tensor:
        coded = sum(_sizes(self.config.tokens))
        return self.local_occupancy(queries, *points_behind(z, coded))

    def describe(self, z: Tensor, points: Tensor, normals: Tensor) -> NoReturn:
        """Raises ModelError: descriptors belong to a pair (`transfer`)."""
        raise _needs_pair("descriptors of one shape alone")

    def invert(self, z: Tensor, k: Tensor) -> NoReturn:
        """Raises ModelError: `transfer` does both at once."""
        raise _needs_pair("descriptors of one shape alone")

    def transfer(
        self, z_reference: Tensor, points: Tensor, normals: Tensor, z_target: Tensor
    ) -> Inverse:
        return self.correspond(z_reference, z_target)[0].transfer(points, normals)

    def correspond(self, z_reference: Tensor, z_target: Tensor) -> tuple[PairMap, PairMap]:
        """The map from references to targets, and that from targets to references."""
        one, other = (unpack(z, self.config.tokens) for z in (z_reference, z_target))
        there, back = self.inverse(one, other)
        return PairMap(one, other, there), PairMap(other, one, back)


class PairMap(NamedTuple):
    """The map from one shape to another: both shapes' tokens, and where the first's arrive."""

    source: Tokens
    target: Tokens
    places: Places

    def transfer(self, points: Tensor, normals: Tensor) -> Inverse:
        """The points of the target that points (b, m, 3) of the source correspond to, which move as
        the tokens around them do, beyond how the bounding box moves."""
        source, target, places = self
        weight = _NORMAL_WEIGHT
        near = squared_distances(
            torch.cat([points, weight * normals], -1),
            torch.cat([source.points, weight * source.normals], -1),
        ).topk(min(_BETWEEN, source.points.shape[1]), dim=-1, largest=False)
        distance = near.values.sqrt()
        share = torch.exp(-((distance / (distance[..., :1] + _SMOOTHING)) ** 2))
        share = share / share.sum(-1, keepdim=True)
        moved = places.points - half_way(source.points, source, target)
        along = torch.cat(
            [moved, places.log_error.exp()[..., None], places.existence[..., None]], -1
        )
        along = (share[..., None] * gather(along, near.indices)).sum(-2)
        return Inverse(
            half_way(points, source, target) + along[..., :3],
            normals,
            existence=along[..., 4],
            log_error=along[..., 3].log(),
        )


class TokenEncoder(nn.Module):
    """A: tokens, and a small PointNet over what is around each at both scales."""

    def __init__(self) -> None:
        super().__init__()
        self.near, self.far = (
            nn.Sequential(
                nn.Linear(GEOMETRY, _POINT_FEATURES // 2),
                nn.GELU("tanh"),
                nn.Linear(_POINT_FEATURES // 2, _POINT_FEATURES),
            )
            for _ in range(2)
        )

    def forward(self, points: Tensor, normals: Tensor, chosen: Tensor) -> Tokens:
        """Tokens `chosen` (b, t) of clouds (b, n, 3) in random order."""
        around = surroundings(points, normals, chosen)
        # max(dim) keeps the indices; amax would spread its gradient over ties, slowly.
        features = [self.near(around.near).max(2)[0], self.far(around.far).max(2)[0]]
        return Tokens(
            around.points, around.normals, torch.cat(features, -1), around.low, around.high
        )


def pack(tokens: Tokens) -> Tensor:
    """Tokens as one row a shape, (b, d_z)."""
    return torch.cat([values.flatten(1) for values in tokens], 1)


def unpack(z: Tensor, count: int) -> Tokens:
    """The tokens of rows (b, d_z) that begin with them."""
    sizes = _sizes(count)
    points, normals, features, low, high = z[:, : sum(sizes)].split(sizes, dim=1)

    def each(values: Tensor) -> Tensor:
        return values.unflatten(1, (count, -1))

    return Tokens(each(points), each(normals), each(features), low, high)


def _sizes(count: int) -> list[int]:
    """Numbers that each part of `pack` has for so many tokens."""
    return [3 * count, 3 * count, 2 * _POINT_FEATURES * count, 3, 3]


def _needs_pair(what: str) -> ModelError:
    return ModelError(f"the model {GENERAL} has no {what}: it maps one shape onto another")
