"""Random deformations of shapes: another plausible member of the category from each one.

A deformation maps a shape's points, normals, queries and correspondence points alike, so inside
stays inside and corresponding points stay corresponding.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import torch
from torch import Tensor

from nrdf.training.config import AugmentConfig

WAVES = 3
STEEPEST = 0.8
"""Bound on the displacement's derivative; below 1 the map cannot fold."""


@dataclass(frozen=True)
class Deformation:
    """x ↦ (M S (x + Σ_k a_k sin(w_k · x + φ_k)) − centre) / size, one for each of b shapes.

    M mirrors z, S scales the axes; centre and size bring the deformed surface back to canonical
    (bounding box centred, longest side 1).
    """

    scale: Tensor  # (b, 3) diagonal of M S
    wave: Tensor  # (b, k, 3)
    phase: Tensor  # (b, k)
    amplitude: Tensor  # (b, k, 3)
    centre: Tensor  # (b, 3)
    size: Tensor  # (b,)

    def points(self, points: Tensor) -> Tensor:
        """Deformed points (b, n, 3)."""
        wave = torch.baddbmm(self.phase[:, None], points, self.wave.transpose(1, 2)).sin()
        moved = torch.baddbmm(points, wave, self.amplitude) * self.scale[:, None]
        return (moved - self.centre[:, None]) / self.size[:, None, None]

    def normals(self, points: Tensor, normals: Tensor) -> Tensor:
        """Unit normals (b, n, 3) of the deformed surface at undeformed points (b, n, 3).

        They transform by the inverse transpose of the Jacobian, taken here as its cofactors.
        """
        b, n, _ = points.shape
        slope = torch.baddbmm(self.phase[:, None], points, self.wave.transpose(1, 2)).cos()
        outer = self.amplitude[..., :, None] * self.wave[..., None, :]
        jacobian = torch.bmm(slope, outer.flatten(2)).view(b, n, 3, 3)
        jacobian = jacobian + torch.eye(3, device=points.device)
        x, y, z = jacobian.unbind(dim=2)
        cofactors = torch.stack(
            [torch.linalg.cross(y, z), torch.linalg.cross(z, x), torch.linalg.cross(x, y)], dim=2
        )
        turned = (cofactors @ normals[..., None]).squeeze(-1) / self.scale[:, None]
        return torch.nn.functional.normalize(turned, dim=-1)

    def select(self, index: Tensor) -> Deformation:
        """The deformations of the shapes at index (p,)."""
        return Deformation(
            self.scale[index],
            self.wave[index],
            self.phase[index],
            self.amplitude[index],
            self.centre[index],
            self.size[index],
        )

    def recanonicalised(self, surface: Tensor) -> Deformation:
        """The same map, followed by what makes the deformed surface (b, n, 3) canonical."""
        plain = replace(self, centre=torch.zeros_like(self.centre), size=torch.ones_like(self.size))
        moved = plain.points(surface)
        low, high = moved.min(dim=1).values, moved.max(dim=1).values
        return replace(self, centre=(low + high) / 2, size=(high - low).max(dim=1).values)

    def misframed(self, error: float, which: Tensor, generator: torch.Generator) -> Deformation:
        """The same maps with errors of standard deviation `error` in centre and log size, where
        `which` (b,) is set: points, queries and correspondences stay true to each other."""
        b, device = self.centre.shape[0], self.centre.device
        wrong = error * torch.randn(b, 4, generator=generator, device=device) * which[:, None]
        return replace(
            self,
            centre=self.centre + self.size[:, None] * wrong[:, :3],
            size=self.size * wrong[:, 3].exp(),
        )


def draw_deformation(
    config: AugmentConfig, surface: Tensor, mirror: Tensor, generator: torch.Generator
) -> Deformation:
    """One random deformation for each of the shapes whose surfaces (b, n, 3) are given.

    `mirror` (b,) is +1 or −1: mirroring z must be the same for both shapes of a pair, so the
    caller draws it.
    """
    b, device = len(surface), surface.device

    def normal(*shape: int) -> Tensor:
        return torch.randn(*shape, generator=generator, device=device)

    scale = (config.scaling * normal(b, 3)).exp()
    scale[:, 2] *= mirror
    direction = torch.nn.functional.normalize(normal(b, WAVES, 3), dim=-1)
    cycles = 0.4 + 0.8 * torch.rand(b, WAVES, 1, generator=generator, device=device)
    wave = 2 * torch.pi * cycles * direction
    phase = 2 * torch.pi * torch.rand(b, WAVES, generator=generator, device=device)
    amplitude = config.warp * normal(b, WAVES, 3)
    steep = (amplitude.norm(dim=-1) * wave.norm(dim=-1)).sum(1)
    if config.stretch > 0:
        axes = torch.eye(3, device=device)
        turns = 2 * torch.pi * (0.5 + torch.rand(b, 3, 1, generator=generator, device=device))
        start = 2 * torch.pi * torch.rand(b, 3, generator=generator, device=device)
        start[:, 2] = 0.0  # left and right stretch alike
        slope = config.stretch * normal(b, 3, 1)
        wave = torch.cat([wave, turns * axes], dim=1)
        phase = torch.cat([phase, start], dim=1)
        amplitude = torch.cat([amplitude, slope / turns * axes], dim=1)
        steep = steep + slope.abs().amax(dim=(1, 2))  # each acts on an axis of its own
    amplitude = amplitude * (STEEPEST / steep.clamp_min(STEEPEST))[:, None, None]
    centre, size = torch.zeros(b, 3, device=device), torch.ones(b, device=device)
    return Deformation(scale, wave, phase, amplitude, centre, size).recanonicalised(surface)


def draw_sample(
    config: AugmentConfig,
    surface: Tensor,
    count: int,
    generator: torch.Generator,
    visible: Tensor | None = None,
) -> Tensor:
    """Indices (b, count) of a random subset of each surface (b, n, 3), as a sensor might leave it.

    Density varies smoothly over the object (`density`, standard deviation of its logarithm at the
    most), and up to `holes` balls of at most `hole_radius` are left out. `count` of n are always
    found: holes give way when the rest is too few, and points are repeated where fewer than
    `count` of a shape are `visible` (b, n).
    """
    b, n, _ = surface.shape
    device = surface.device
    # Gumbel noise on log weights: the largest `count` are a weighted draw without replacement.
    noise = torch.rand(b, n, generator=generator, device=device).clamp_min(1e-9)
    key = -(-noise.log()).log()
    if config.density > 0:
        direction = torch.randn(b, 3, 1, generator=generator, device=device) * 4
        phase = 6.28 * torch.rand(b, 1, 1, generator=generator, device=device)
        height = config.density * torch.rand(b, 1, generator=generator, device=device)
        key = key + 1.4 * height * (surface @ direction + phase).sin().squeeze(-1)
    for _ in range(config.holes):
        pick = torch.randint(n, (b,), generator=generator, device=device)
        centre = surface[torch.arange(b, device=device), pick]
        radius = config.hole_radius * torch.rand(b, 1, generator=generator, device=device)
        inside = (surface - centre[:, None]).square().sum(-1) < radius.square()
        key = key - 100.0 * inside
    if visible is None:
        return key.topk(count, dim=1).indices
    best = key.masked_fill(~visible, -torch.inf).topk(count, dim=1).indices
    seen = visible.sum(1, keepdim=True).clamp(1, count)
    return best.gather(1, torch.arange(count, device=device) % seen)


def sensor_noise(
    config: AugmentConfig, points: Tensor, normals: Tensor, generator: torch.Generator
) -> tuple[Tensor, Tensor]:
    """Points and unit normals (b, n, 3) with noise whose size differs from shape to shape."""

    def noise(largest: float) -> Tensor:
        size = torch.rand(len(points), 1, 1, generator=generator, device=points.device)
        grain = torch.randn(points.shape, generator=generator, device=points.device)
        return largest * size * grain

    if config.noise > 0:
        points = points + noise(config.noise)
    if config.normal_noise > 0:
        normals = torch.nn.functional.normalize(normals + noise(config.normal_noise), dim=-1)
    return points, normals
