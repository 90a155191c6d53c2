"""Tokens: spread over the cloud, and what is around them."""

from __future__ import annotations

import torch

from nrdf.field.tokens import (
    GEOMETRY,
    NEIGHBOURS,
    farthest_points,
    gather,
    neighbourhood,
    squared_distances,
    surroundings,
)


def cloud(count: int = 300) -> tuple[torch.Tensor, torch.Tensor]:
    """Two unit spheres of random points, with normals."""
    generator = torch.Generator().manual_seed(0)
    points = torch.nn.functional.normalize(torch.randn(2, count, 3, generator=generator), dim=-1)
    return points / 2, points


def test_farthest_points_leave_no_gap_that_random_ones_leave():
    points, _ = cloud()
    chosen = farthest_points(points, 40)
    assert all(len(set(row.tolist())) == 40 for row in chosen)

    def gap(index: torch.Tensor) -> float:
        return float(squared_distances(points, gather(points, index)).amin(2).max())

    assert gap(chosen) < 0.6 * gap(torch.arange(40).expand(2, 40))


def test_neighbours_are_told_in_the_tokens_own_terms():
    points, normals = cloud()
    at, facing = points[:, :5], normals[:, :5]
    around = neighbourhood(at, facing, points, normals, 0.1)
    assert around.shape == (2, 5, NEIGHBOURS, GEOMETRY)
    offset, distance, alike, ahead = around[..., :3], around[..., 3], around[..., 7], around[..., 8]
    torch.testing.assert_close(offset.norm(dim=-1), distance)
    torch.testing.assert_close(distance[..., 0], torch.zeros(2, 5))  # itself, the nearest
    torch.testing.assert_close(alike[..., 0], torch.ones(2, 5))
    assert bool((ahead <= 1e-5).all())  # nothing lies in front of a convex surface


def test_the_wide_scale_reaches_farther_than_the_near_one():
    points, normals = cloud(1024)
    found = surroundings(points, normals, farthest_points(points, 8))
    assert found.far[..., 3].mean() * 0.25 > 1.5 * found.near[..., 3].mean() * 0.08
    torch.testing.assert_close(found.high, points.amax(1))
