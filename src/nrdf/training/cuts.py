"""Shapes without one of their ends: another build of the category from each one.

A chair that is cut off above its seat is a stool, and one without its sides has no arms. The
bounding box is that of the rest, so places must be told by the shape around them and not by where
they are in the box; and what is cut off is known not to exist.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

# Shares of the cuts that take the upper end, the lower end, and the left and right side together;
# the others take the front or the rear.
_UPPER, _LOWER, _SIDES = 0.55, 0.15, 0.2
_LEAST, _MOST = 0.35, 0.95  # share of the extent that is left


@dataclass(frozen=True)
class Cuts:
    """One for each of b shapes: axis (b,) of the plane's normal; sign (b,), +1 where the upper end
    goes, −1 where the lower one does, 0 where both do; limit (b,) of the coordinate along that
    direction, or away from the middle; infinite for a shape that stays whole."""

    axis: Tensor
    sign: Tensor
    limit: Tensor

    def keep(self, points: Tensor) -> Tensor:
        """Which points (b, n, 3), undeformed, are on the part that stays: (b, n) bool."""
        return _along(points, self.axis, self.sign) <= self.limit[:, None]

    def kept(self, surface: Tensor) -> Tensor:
        """The surface (b, n, 3), every point that is cut off replaced by one that stays."""
        keep = self.keep(surface)
        one = surface[torch.arange(len(surface), device=surface.device), keep.int().argmax(1)]
        return torch.where(keep[..., None], surface, one[:, None])

    def select(self, index: Tensor) -> Cuts:
        """The cuts of the shapes at index (p,)."""
        return Cuts(self.axis[index], self.sign[index], self.limit[index])


def draw_cuts(surface: Tensor, probability: float, generator: torch.Generator) -> Cuts:
    """A random cut for each surface (b, n, 3), undeformed, with that probability.

    From 35 to 95 % of the extent along the axis stays.
    """
    b, device = len(surface), surface.device
    luck, side, share, whole = torch.rand(4, b, generator=generator, device=device)
    axis = torch.ones(b, dtype=torch.long, device=device)
    axis[luck >= _UPPER + _LOWER] = 2
    axis[luck >= _UPPER + _LOWER + _SIDES] = 0
    sign = torch.where(luck < _UPPER, 1.0, -1.0)
    sign[axis == 2] = 0.0
    sign = torch.where((axis == 0) & (side < 0.5), 1.0, sign)
    along = _along(surface, axis, sign)
    low, high = along.min(1).values, along.max(1).values
    low = torch.where(sign == 0, 0.0, low)
    limit = low + (_LEAST + (_MOST - _LEAST) * share) * (high - low)
    return Cuts(axis, sign, torch.where(whole < probability, limit, torch.inf))


def _along(points: Tensor, axis: Tensor, sign: Tensor) -> Tensor:
    """Coordinates (b, n) of points (b, n, 3) along an axis (b,), in the direction sign (b,); how
    far they are from the middle where that is 0."""
    index = axis[:, None, None].expand(-1, points.shape[1], 1)
    along = points.gather(2, index).squeeze(2)
    return torch.where((sign == 0)[:, None], along.abs(), along * sign[:, None])
