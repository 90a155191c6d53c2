"""Inside or outside, by the points of the cloud that are near.

One code for a whole shape cannot say where a leg of 2 cm ends, and a grid of features neither. The
points around a place and their normals can, on objects of any kind. As in point convolution for
surface reconstruction (POCO; Boulch and Marlet, CVPR 2022), a place sees its nearest points, and
attention weighs what each of them says.
"""

from __future__ import annotations

from typing import Annotated

import torch
from pydantic import Field
from torch import Tensor, nn

from nrdf.field.tokens import gather, squared_distances

_NEIGHBOURS = 12
_SPACING = 4  # nearest points whose mean distance is the length that counts as one
_SHORTEST = 1e-3  # canonical; that length is at least this
_FEATURES = 10
_HEADS = 8

Width = Annotated[int, Field(ge=_HEADS, multiple_of=_HEADS)]
"""Size of a field's configuration: features of each near point."""


class LocalOccupancy(nn.Module):
    """Occupancy logits of places, from a cloud's points and normals around them."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.each = nn.Sequential(
            nn.Linear(_FEATURES, width), nn.GELU("tanh"), nn.Linear(width, width)
        )
        self.together = nn.Sequential(
            nn.Linear(2 * width, width), nn.GELU("tanh"), nn.Linear(width, width)
        )
        self.attention = nn.Linear(width, _HEADS)
        self.leave = nn.Sequential(nn.Linear(width, width), nn.GELU("tanh"), nn.Linear(width, 1))

    def forward(self, places: Tensor, points: Tensor, normals: Tensor) -> Tensor:
        """Logits (b, q) at places (b, q, 3) of clouds with points and unit normals (b, n, 3)."""
        with torch.autocast(places.device.type, enabled=False):
            features = _seen_from(places.float(), points.float(), normals.float())
        x = self.each(features)
        # max(dim) keeps the indices; amax would spread its gradient over ties, slowly.
        x = self.together(torch.cat([x, x.max(2, keepdim=True)[0].expand_as(x)], dim=-1))
        share = self.attention(x).softmax(dim=2)[..., None]
        x = (share * x.unflatten(-1, (_HEADS, -1))).sum(2).flatten(-2)
        return self.leave(x)[..., 0]


def with_points(z: Tensor, points: Tensor, normals: Tensor) -> Tensor:
    """Codes z (b, d), and behind them the points and normals (b, n, 3) that they were made of."""
    return torch.cat([z, points.flatten(1), normals.flatten(1)], dim=1)


def points_behind(z: Tensor, coded: int) -> tuple[Tensor, Tensor]:
    """The points and normals (b, n, 3) behind the first `coded` values of `with_points`."""
    points, normals = z[:, coded:].unflatten(1, (2, -1, 3)).unbind(1)
    return points, normals


def _seen_from(places: Tensor, points: Tensor, normals: Tensor) -> Tensor:
    """(b, q, k, `_FEATURES`): of each near point the offset to the place and its length, in units
    of the points' spacing there; its normal; how far the place lies in front of it, in that unit
    and in tenths of the shape's size; and the spacing."""
    count = min(_NEIGHBOURS, points.shape[1])
    near = squared_distances(places, points).topk(count, dim=-1, largest=False).indices
    normal = gather(normals, near)
    offset = places[:, :, None] - gather(points, near)
    distance = offset.norm(dim=-1, keepdim=True)
    spacing = distance[:, :, :_SPACING].mean(2, keepdim=True) + _SHORTEST
    ahead = (offset * normal).sum(-1, keepdim=True)
    return torch.cat(
        [
            offset / spacing,
            distance / spacing,
            normal,
            ahead / spacing,
            10 * ahead,
            spacing.log().expand_as(distance),
        ],
        dim=-1,
    )
