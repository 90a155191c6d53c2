"""A cloud as a set of local tokens: points spread over it, each with the geometry around it.

A token is a point of the cloud, chosen so that all are far from each other (farthest points), and
what lies around it at two scales: the nearest of all points, and the nearest of a sparse subset.
"""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor

GEOMETRY = 9
"""Numbers that describe one neighbour of a token."""
NEIGHBOURS = 16
_NEAR, _FAR = 0.08, 0.25  # canonical lengths that count as one, of each scale
_SPARSE = 256  # points of the sparse subset


class Surroundings(NamedTuple):
    """Tokens of b clouds: points, normals (b, t, 3); near, far (b, t, k, `GEOMETRY`); low, high
    (b, 3), corners of the clouds' bounding boxes."""

    points: Tensor
    normals: Tensor
    near: Tensor
    far: Tensor
    low: Tensor
    high: Tensor


def surroundings(points: Tensor, normals: Tensor, chosen: Tensor) -> Surroundings:
    """The tokens `chosen` (b, t) of clouds: points (b, n, 3) in random order, and unit normals."""
    at, facing = gather(points, chosen), gather(normals, chosen)
    step = max(1, points.shape[1] // _SPARSE)
    return Surroundings(
        at,
        facing,
        neighbourhood(at, facing, points, normals, _NEAR),
        neighbourhood(at, facing, points[:, ::step], normals[:, ::step], _FAR),
        points.amin(1),
        points.amax(1),
    )


def farthest_points(points: Tensor, count: int) -> Tensor:
    """Indices (b, count) of points (b, n, 3), each the farthest from those before it."""
    x, y, z = (points[..., axis].contiguous() for axis in range(3))
    current = torch.zeros(len(points), 1, dtype=torch.long, device=points.device)
    distance = torch.full_like(x, torch.inf)
    chosen = []
    for _ in range(count):
        chosen.append(current)
        squared = (x - x.gather(1, current)).square_()
        squared += (y - y.gather(1, current)).square_()
        squared += (z - z.gather(1, current)).square_()
        distance = torch.minimum(distance, squared)
        current = distance.argmax(1, keepdim=True)
    return torch.cat(chosen, 1)


def neighbourhood(
    at: Tensor, facing: Tensor, points: Tensor, normals: Tensor, length: float
) -> Tensor:
    """The nearest of points (b, n, 3) around places `at` (b, t, 3) that face `facing`.

    (b, t, k, `GEOMETRY`): where each lies and how far, in units of `length`; its normal; how much
    it faces as the token does; how far it lies in front of it.
    """
    count = min(NEIGHBOURS, points.shape[1])
    nearest = squared_distances(at, points).topk(count, dim=-1, largest=False).indices
    there, normal = gather(points, nearest), gather(normals, nearest)
    offset = (there - at[:, :, None]) / length
    ahead = facing[:, :, None]
    return torch.cat(
        [
            offset,
            offset.norm(dim=-1, keepdim=True),
            normal,
            (normal * ahead).sum(-1, keepdim=True),
            (offset * ahead).sum(-1, keepdim=True),
        ],
        dim=-1,
    )


def gather(values: Tensor, indices: Tensor) -> Tensor:
    """Rows of values (b, m, d) at indices (b, ...): (b, ..., d)."""
    flat = indices.reshape(indices.shape[0], -1, 1).expand(-1, -1, values.shape[-1])
    return values.gather(1, flat).reshape(*indices.shape, values.shape[-1])


def squared_distances(first: Tensor, second: Tensor) -> Tensor:
    """Squared distances (b, n, m) between points (b, n, 3) and (b, m, 3)."""
    a, b = first.square().sum(-1)[:, :, None], second.square().sum(-1)[:, None]
    return (a + b - 2 * first @ second.transpose(1, 2)).clamp_min(0)
