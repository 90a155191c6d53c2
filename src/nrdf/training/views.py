"""Partial views: what one to four depth cameras around an object see of its surface.

Which stored points are seen from which directions is worked out once, when the shapes are loaded
(orthographic depth images stand in for hidden-point removal, Katz et al. 2007), and kept as one
bit a direction. A step then only draws directions.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from nrdf.geometry.sampling import fibonacci_directions
from nrdf.geometry.visibility import seen_from

MOST_VIEWS = 4
_LOWEST, _HIGHEST = -0.3, 0.97
"""Sines of the cameras' elevations: nobody scans an object that stands from straight below."""
_around = fibonacci_directions(96)[:, [0, 2, 1]]
DIRECTIONS = _around[(_around[:, 1] > _LOWEST) & (_around[:, 1] < _HIGHEST)]
"""(d, 3), d at most 63: +Y is up."""


def view_bits(surface: Tensor, normals: Tensor) -> Tensor:
    """(b, n) int64: bit i is set where direction i sees the point of `surface` (b, n, 3).

    `normals` (b, n, 3) unit, outward. Takes about 15 ms a shape of 4096 points.
    """
    power = 1 << np.arange(len(DIRECTIONS), dtype=np.int64)
    rows = [
        power @ seen_from(points, lines, DIRECTIONS).astype(np.int64)
        for points, lines in zip(surface.cpu().numpy(), normals.cpu().numpy(), strict=True)
    ]
    return torch.from_numpy(np.stack(rows)).to(surface.device)


def draw_views(bits: Tensor, probability: float, generator: torch.Generator) -> Tensor:
    """(b, n) bool: the points that the encoder may see of each shape, all or those in the views.

    `bits` (b, n) as `view_bits` gives them. Each shape is seen in part with `probability`, from 1
    to `MOST_VIEWS` directions; it is seen whole where those would see nothing.
    """
    b, device = len(bits), bits.device

    def integers(high: int, *shape: int) -> Tensor:
        return torch.randint(high, shape, generator=generator, device=device)

    chosen = torch.bitwise_left_shift(
        torch.ones((), dtype=torch.int64, device=device), integers(len(DIRECTIONS), b, MOST_VIEWS)
    )
    count = 1 + integers(MOST_VIEWS, b, 1)
    chosen = chosen * (torch.arange(MOST_VIEWS, device=device) < count)
    seen = (bits[..., None] & chosen[:, None]).ne(0).any(-1)
    partial = torch.rand(b, generator=generator, device=device) < probability
    partial &= seen.any(1)
    return seen | ~partial[:, None]


def visible_extremes(surface: Tensor, visible: Tensor) -> Tensor:
    """(b, 6) indices of the lowest and highest point of each axis among the `visible` (b, n)."""
    hidden = ~visible[..., None]
    low = surface.masked_fill(hidden, torch.inf).argmin(1)
    high = surface.masked_fill(hidden, -torch.inf).argmax(1)
    return torch.cat([low, high], dim=1)
