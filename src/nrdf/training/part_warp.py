"""Deformations that change the parts of a shape: another member of its category from each one.

Handles on the surface carry affine maps of their own, blended smoothly between them (linear blend
skinning), so that parts grow, shrink, bend and move against each other; then each axis is stretched
by a wave and scaled. Most deformations are alike left and right.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn import functional

_HANDLES = 6
_REACH = 0.07, 0.28  # least canonical length over which handles are blended, and range above it
_SHEAR, _SHIFT, _WAVE, _SCALE = 0.3, 0.22, 0.9, 0.7  # in shares of the strength
_STEEPEST = 0.7  # of a wave; below 1 the map cannot fold
_SYMMETRIC = 0.75  # share of the deformations that are alike left and right


@dataclass(frozen=True)
class PartWarp:
    """Of b shapes. handles (b, h, 3) with affine maps linear (b, h, 3, 3), shift (b, h, 3), blended
    over reach (b, 1, 1); symmetric (b, 1, 1) 1 or 0; of each axis a wave: turns, phase, slope, and
    scale (b, 1, 3)."""

    handles: Tensor
    linear: Tensor
    shift: Tensor
    reach: Tensor
    symmetric: Tensor
    turns: Tensor
    phase: Tensor
    slope: Tensor
    scale: Tensor

    def apply(self, points: Tensor, normals: Tensor) -> tuple[Tensor, Tensor]:
        """Deformed points and unit normals (b, n, 3)."""
        mirror = torch.tensor([1.0, 1.0, -1.0], device=points.device)
        moved, jacobian = self._blend(points)
        image, image_jacobian = self._blend(points * mirror)
        share = self.symmetric / 2
        moved = (1 - share) * moved + share * image * mirror
        image_jacobian = mirror[:, None] * image_jacobian * mirror
        jacobian = (1 - share[..., None]) * jacobian + share[..., None] * image_jacobian
        normals = _turned(jacobian, normals)
        angle = self.turns * moved + self.phase
        slope = (1 + self.slope * angle.cos()) * self.scale
        moved = (moved + self.slope / self.turns * angle.sin()) * self.scale
        return moved, functional.normalize(normals / slope, dim=-1)

    def _blend(self, points: Tensor) -> tuple[Tensor, Tensor]:
        """Points (b, n, 3) moved by the handles, and the map's derivatives (b, n, 3, 3) there."""
        offset = points[:, :, None] - self.handles[:, None]
        weight = (-offset.square().sum(-1) / (2 * self.reach**2)).softmax(-1)[..., None]
        placed = (self.linear[:, None] * offset[..., None, :]).sum(-1)
        placed = placed + (self.handles + self.shift)[:, None]
        slope = -offset / self.reach[..., None] ** 2
        slope = weight * (slope - (weight * slope).sum(2, keepdim=True))
        jacobian = weight[..., None] * self.linear[:, None]
        jacobian = (jacobian + placed[..., :, None] * slope[..., None, :]).sum(2)
        return (weight * placed).sum(2), jacobian


def draw_part_warp(surface: Tensor, strength: Tensor, generator: torch.Generator) -> PartWarp:
    """A random deformation of each surface (b, n, 3), of some strength (b,): the logarithms of
    parts' proportions vary by about that much."""
    b = len(surface)

    def uniform(*shape: int) -> Tensor:
        return torch.rand(*shape, generator=generator)

    def normal(*shape: int) -> Tensor:
        return torch.randn(*shape, generator=generator)

    chosen = torch.randint(surface.shape[1], (b, _HANDLES), generator=generator)
    strong = strength.view(b, 1, 1)
    size = (strong[..., None] * normal(b, _HANDLES, 1, 3)).exp()
    shear = _SHEAR * strong[..., None] * normal(b, _HANDLES, 3, 3)
    return PartWarp(
        handles=surface[torch.arange(b)[:, None], chosen],
        linear=torch.eye(3) * size + shear * (uniform(b, 1, 1, 1) < 0.5),
        shift=_SHIFT * strong * normal(b, _HANDLES, 3),
        reach=_REACH[0] + _REACH[1] * uniform(b, 1, 1),
        symmetric=(uniform(b, 1, 1) < _SYMMETRIC).float(),
        turns=2 * math.pi * (0.3 + uniform(b, 1, 3)),
        phase=2 * math.pi * uniform(b, 1, 3),
        slope=(_WAVE * strong * normal(b, 1, 3)).clamp(-_STEEPEST, _STEEPEST),
        scale=(_SCALE * strong * normal(b, 1, 3)).exp(),
    )


def _turned(jacobian: Tensor, normals: Tensor) -> Tensor:
    """Unit normals (b, n, 3) after a map: they turn by its cofactors."""
    x, y, z = jacobian.unbind(-1)
    cross = torch.linalg.cross
    cofactors = torch.stack([cross(y, z), cross(z, x), cross(x, y)], -1)
    return functional.normalize((cofactors @ normals[..., None]).squeeze(-1), dim=-1)
