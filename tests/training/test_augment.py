"""Deformations keep normals normal, corresponding points corresponding, and shapes canonical."""

from __future__ import annotations

import torch

from nrdf.training.augment import draw_deformation, draw_sample
from nrdf.training.config import AugmentConfig

STRONG = AugmentConfig(scaling=0.2, warp=0.05, stretch=0.4, mirror=True)


def sphere(count: int = 400) -> torch.Tensor:
    direction = torch.randn(3, count, 3, generator=torch.Generator().manual_seed(5))
    return 0.5 * torch.nn.functional.normalize(direction, dim=-1)


def draw(surface, config=STRONG, mirror=(1.0, -1.0, 1.0), seed=0):
    return draw_deformation(
        config, surface, torch.tensor(mirror), torch.Generator().manual_seed(seed)
    )


def test_deformed_surface_is_canonical():
    surface = sphere()
    moved = draw(surface).points(surface)
    low, high = moved.min(1).values, moved.max(1).values
    assert torch.allclose(low + high, torch.zeros(3, 3), atol=1e-5)
    assert torch.allclose((high - low).max(1).values, torch.ones(3), atol=1e-5)


def test_deformation_is_not_the_identity_and_differs_between_shapes():
    surface = sphere()[:1].expand(3, -1, -1)
    moved = draw(surface, mirror=(1.0, 1.0, 1.0)).points(surface)
    assert (moved[0] - surface[0]).norm(dim=-1).mean() > 0.01
    assert (moved[0] - moved[1]).norm(dim=-1).mean() > 0.01


def test_normals_stay_orthogonal_to_deformed_tangents_and_outward():
    surface = sphere()
    normals = torch.nn.functional.normalize(surface, dim=-1)
    deform = draw(surface)
    tangent = torch.linalg.cross(normals, torch.tensor([0.3, 0.5, 0.8]).expand_as(normals))
    step = 1e-3
    moved = deform.points(surface + step * tangent) - deform.points(surface - step * tangent)
    outside = deform.points(surface + step * normals) - deform.points(surface)
    turned = deform.normals(surface, normals)
    assert torch.allclose(turned.norm(dim=-1), torch.ones(3, 400), atol=1e-5)
    cosine = (torch.nn.functional.normalize(moved, dim=-1) * turned).sum(-1)
    assert cosine.abs().max() < 0.01
    assert ((outside * turned).sum(-1) > 0).all()


def test_without_augmentation_nothing_moves():
    surface = sphere()
    surface = surface - (surface.min(1, True).values + surface.max(1, True).values) / 2
    surface = surface / (surface.max(1, True).values - surface.min(1, True).values).max()
    deform = draw(surface, AugmentConfig(), mirror=(1.0, 1.0, 1.0))
    size = (surface.max(1).values - surface.min(1).values).max(1).values
    assert torch.allclose(deform.points(surface), surface / size[:, None, None], atol=1e-6)


def test_mirror_swaps_left_and_right():
    surface = sphere()
    plain = draw(surface, mirror=(1.0, 1.0, 1.0)).points(surface)
    flipped = draw(surface, mirror=(-1.0, -1.0, -1.0)).points(surface)
    assert torch.allclose(plain * torch.tensor([1.0, 1.0, -1.0]), flipped, atol=1e-5)


def test_stretching_changes_proportions_and_keeps_sides_and_order():
    surface = sphere()
    surface = torch.cat([surface, surface * torch.tensor([1.0, 1.0, -1.0])], dim=1)
    deform = draw(surface, AugmentConfig(stretch=2.0), mirror=(1.0, 1.0, 1.0))
    right, left = deform.points(surface).chunk(2, dim=1)
    assert torch.allclose(right * torch.tensor([1.0, 1.0, -1.0]), left, atol=1e-5)
    line = torch.linspace(-0.5, 0.5, 101)[:, None].expand(3, 101, 3)
    steps = deform.points(line).diff(dim=1)
    assert (steps > 0).all(), "folded"
    assert (steps.amax(1) > 1.5 * steps.amin(1)).any(1).all()


def test_select_gives_the_maps_of_the_chosen_shapes():
    surface = sphere()
    deform = draw(surface)
    index = torch.tensor([2, 0])
    assert torch.allclose(
        deform.select(index).points(surface[index]), deform.points(surface)[index]
    )


def test_sample_has_no_repetitions_and_leaves_holes():
    surface = sphere(2000)
    config = AugmentConfig(density=1.0, holes=1, hole_radius=0.6)
    chosen = draw_sample(config, surface, 300, torch.Generator().manual_seed(2))
    assert all(len(set(row.tolist())) == 300 for row in chosen)
    kept = surface.gather(1, chosen[..., None].expand(-1, -1, 3))
    gap = torch.cdist(surface, kept).min(2).values.max(1).values
    whole = draw_sample(AugmentConfig(), surface, 300, torch.Generator().manual_seed(2))
    even = surface.gather(1, whole[..., None].expand(-1, -1, 3))
    assert gap.max() > 2 * torch.cdist(surface, even).min(2).values.max()


def test_sample_of_all_points_survives_holes():
    surface = sphere(50)
    config = AugmentConfig(holes=3, hole_radius=5.0)
    chosen = draw_sample(config, surface, 50, torch.Generator().manual_seed(2))
    assert sorted(chosen[0].tolist()) == list(range(50))
