"""Deformations by parts: normals stay normal to the surface, sides stay alike, and parts change."""

from __future__ import annotations

import torch

from nrdf.training.part_warp import draw_part_warp


def sphere(count: int = 400) -> torch.Tensor:
    generator = torch.Generator().manual_seed(0)
    return torch.nn.functional.normalize(torch.randn(3, count, 3, generator=generator), dim=-1)


def warp_of(surface: torch.Tensor, strength: float):
    generator = torch.Generator().manual_seed(1)
    return draw_part_warp(surface, torch.full((len(surface),), strength), generator)


def test_normals_turn_with_the_surface():
    normals = sphere()
    points = normals / 2
    tangents = torch.nn.functional.normalize(
        torch.linalg.cross(normals, torch.ones_like(normals)), dim=-1
    )
    warp = warp_of(points, 0.2)
    moved, turned = warp.apply(points, normals)
    step = 1e-3
    beside, _ = warp.apply(points + step * tangents, normals)
    along = torch.nn.functional.normalize(beside - moved, dim=-1)
    assert float((along * turned).sum(-1).abs().quantile(0.95)) < 0.02


def test_stronger_warps_change_more_and_none_changes_nothing():
    points = sphere() / 2
    spread = [
        float((warp_of(points, strength).apply(points, 2 * points)[0] - points).std())
        for strength in (0.0, 0.1, 0.4)
    ]
    assert spread[0] < 1e-5 < spread[1] < spread[2]


def test_symmetric_ones_keep_left_and_right_alike():
    points = sphere() / 2
    mirror = torch.tensor([1.0, 1.0, -1.0])
    warp = warp_of(points, 0.3)
    warp.phase[..., 2] = 0.0  # a wave along z is odd about the middle
    warp.symmetric[:] = 1.0
    one, _ = warp.apply(points, points)
    other, _ = warp.apply(points * mirror, points)
    torch.testing.assert_close(one, other * mirror, atol=1e-5, rtol=0)
