"""Partial views: only what cameras see is kept, and the rest of a batch stays true to it."""

from __future__ import annotations

import torch

from builders.tiny_field import balls, tiny_config
from nrdf.training.augment import draw_sample
from nrdf.training.config import AugmentConfig
from nrdf.training.dataset import ShapeDataset
from nrdf.training.views import DIRECTIONS, draw_views, view_bits, visible_extremes

VIEWS = AugmentConfig(views=1.0)


def sphere(count: int = 2000) -> torch.Tensor:
    direction = torch.randn(1, count, 3, generator=torch.Generator().manual_seed(5))
    return torch.nn.functional.normalize(direction, dim=-1)


def test_a_direction_sees_the_half_of_a_ball_that_faces_it():
    normals = sphere()
    bits = view_bits(0.5 * normals, normals)
    views = torch.as_tensor(DIRECTIONS, dtype=torch.float32)
    seen = (bits[..., None] >> torch.arange(len(views)) & 1).bool()[0].T
    facing = views @ normals[0].T
    assert seen[facing > 0.3].float().mean() > 0.94
    assert seen[facing > 0.7].all()
    assert not seen[facing < 0.1].any()


def test_what_stands_behind_is_not_seen():
    grid = torch.linspace(-0.5, 0.5, 40)
    y, z = (part.flatten() for part in torch.meshgrid(grid, grid, indexing="ij"))
    walls = torch.stack([torch.stack([torch.full_like(y, x), y, z], 1) for x in (0.0, -0.3)])
    surface = walls.flatten(0, 1)[None]
    normals = torch.tensor([1.0, 0.0, 0.0]).expand_as(surface)
    seen = (view_bits(surface, normals)[0, :, None] >> torch.arange(len(DIRECTIONS)) & 1).bool()
    frontal = int(torch.as_tensor(DIRECTIONS)[:, 0].argmax())
    assert seen[:1600, frontal].float().mean() > 0.95
    assert seen[1600:, frontal].float().mean() < 0.15


def test_a_shape_is_seen_whole_or_from_one_to_four_directions():
    normals = sphere(500).expand(400, -1, -1)
    bits = view_bits(0.5 * normals[:1], normals[:1]).expand(400, -1)
    generator = torch.Generator().manual_seed(0)
    share = draw_views(bits, 0.6, generator).float().mean(1)
    whole = (share == 1).float().mean()
    assert 0.33 < whole < 0.47
    assert share.min() > 0.25 and share[share < 1].max() < 0.98
    assert draw_views(bits, 0.0, generator).all()
    nothing = torch.zeros_like(bits)
    assert draw_views(nothing, 1.0, generator).all(), "a shape that no view sees is seen whole"


def test_samples_repeat_visible_points_rather_than_show_hidden_ones():
    surface = sphere(50)
    visible = torch.arange(50)[None] < 8
    config = AugmentConfig(holes=2, hole_radius=5.0)
    chosen = draw_sample(config, surface, 40, torch.Generator().manual_seed(2), visible)
    assert chosen.shape == (1, 40)
    assert sorted(set(chosen[0].tolist())) == list(range(8))


def test_extremes_are_those_of_the_visible_points():
    surface = sphere(300)
    visible = surface[..., 0] > 0
    kept = surface[0, visible_extremes(surface, visible)[0]]
    part = surface[0, visible[0]]
    assert torch.equal(kept[:3].diagonal(), part.min(0).values)
    assert torch.equal(kept[3:].diagonal(), part.max(0).values)


def tiny_dataset(augment: AugmentConfig, **changes) -> ShapeDataset:
    changes = {"surface_points": 2000, "encoder_points": 400, "augment": augment, **changes}
    return ShapeDataset(balls(6, count=2000), tiny_config().data.model_copy(update=changes))


def test_a_batch_shows_parts_of_shapes_in_the_frame_of_the_whole():
    whole, part = (
        tiny_dataset(augment, correspondences=400).batch(4, 0, 0)
        for augment in (AugmentConfig(), VIEWS)
    )
    extent = [(b.points.amax(1) - b.points.amin(1)).prod(1) for b in (whole, part)]
    assert (extent[1] < extent[0] + 1e-6).all() and (extent[1] < 0.9 * extent[0]).any()
    # Correspondences are those of whole shapes, hidden places included.
    for name in ("source", "target"):
        spread = (getattr(part, name).amax(1) - getattr(part, name).amin(1)).amax(1)
        assert (spread > 0.93).all()
    assert part.points.shape == whole.points.shape


def test_an_error_of_the_frame_moves_everything_alike():
    batch = tiny_dataset(AugmentConfig(views=1.0, view_frame=0.1), queries=500).batch(4, 0, 0)
    assert (batch.target.amax(1) - batch.target.amin(1)).amax(1).sub(1).abs().max() > 0.05
    # The surface that the moved points lie on still tells queries inside from outside.
    seen = batch.clean_points
    near = torch.cdist(batch.queries, seen).min(2)
    index = near.indices[..., None].expand(-1, -1, 3)
    away = batch.queries - seen.gather(1, index)
    side = (away * batch.clean_normals.gather(1, index)).sum(-1) < 0
    close = near.values < 0.1
    assert (side == batch.occupancy.bool())[close].float().mean() > 0.9


def test_validation_sees_whole_shapes():
    for plain in tiny_dataset(VIEWS).plain().values():
        batch = plain.batch(4, 0, 0)
        assert ((batch.points.amax(1) - batch.points.amin(1)).amax(1) > 0.97).all()
