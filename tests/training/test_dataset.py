"""Batches: pure functions of (seed, step, rank) whose correspondences are true."""

from __future__ import annotations

import dataclasses

import pytest
import torch

from builders.tiny_field import Ball, balls, tiny_config, tiny_dataset, write_folder
from nrdf.errors import ConfigError, DataError
from nrdf.training.config import AugmentConfig, Stage
from nrdf.training.dataset import ShapeDataset, load_dataset
from nrdf.training.pools import draw_shapes
from nrdf.training.provenance import list_shapes

CONFIG = tiny_config().data


def tensors(batch):
    return [getattr(batch, f.name) for f in dataclasses.fields(batch)]


def test_a_batch_depends_on_seed_step_and_rank_alone():
    one, two = tiny_dataset(), tiny_dataset()
    two.batch(4, seed=1, step=99)
    for a, b in zip(tensors(one.batch(4, 7, 3)), tensors(two.batch(4, 7, 3)), strict=True):
        assert torch.equal(a, b)
    first = one.batch(4, 7, 3).points
    assert not torch.equal(first, one.batch(4, 7, 4).points)
    assert not torch.equal(first, one.batch(4, 8, 3).points)
    assert not torch.equal(first, one.batch(2, 7, 3, rank=1, world=2).points[:, : len(first)])


def test_shapes_and_sizes():
    batch = tiny_dataset().batch(4, 0, 0)
    assert batch.points.shape == batch.normals.shape == (4, 64, 3)
    assert batch.queries.shape == (4, 32, 3) and batch.occupancy.shape == (4, 32)
    assert batch.source.shape == batch.target_normals.shape == (8, 32, 3)
    assert batch.weight.shape == (8, 32) and batch.known.shape == (8, 32)
    assert all(value.isfinite().all() for value in tensors(batch) if value.is_floating_point())


def ellipsoid_value(points, radii):
    return ((points / torch.tensor(radii)) ** 2).sum(-1)


def test_correspondences_are_true_without_deformation():
    shapes = balls()
    found = tiny_dataset(shapes, augment=AugmentConfig())
    chosen, _ = draw_shapes(found.pools, 4, 0, 0, 0, 1)
    batch = found.batch(4, 0, 0)
    assert (batch.weight == 1).all() and batch.known.all()
    for pair in range(len(batch.reference)):
        a = shapes[chosen[batch.reference[pair]]]
        b = shapes[chosen[batch.partner[pair]]]
        scale = (torch.tensor(b.radii) / torch.tensor(a.radii)).float()
        # Recanonicalising by the sampled surface's box moves everything by a few thousandths.
        assert torch.allclose(batch.source[pair] * scale, batch.target[pair], atol=0.02)
        cosine = batch.target_normals[pair] * batch.target[pair] / torch.tensor(b.radii) ** 2
        assert (cosine.sum(-1) > 0).all()


def test_deformation_moves_points_queries_and_correspondences_alike():
    batch = tiny_dataset(
        balls(6, count=3000), encoder_points=2000, surface_points=3000, queries=500
    )
    batch = batch.batch(4, 3, 0)
    # Correspondence points lie on the same deformed surface as the encoder's clean points.
    gap = torch.cdist(batch.source[:4], batch.clean_points[batch.reference[:4]]).min(2).values
    assert gap.max() < 0.05
    gap = torch.cdist(batch.target[:4], batch.clean_points[batch.partner[:4]]).min(2).values
    assert gap.max() < 0.05
    # A query is inside exactly if the nearest surface point's normal faces away from it.
    near = (
        torch.cdist(batch.queries, batch.clean_points).min(2).indices[..., None].expand(-1, -1, 3)
    )
    away = batch.queries - batch.clean_points.gather(1, near)
    side = (away * batch.clean_normals.gather(1, near)).sum(-1) < 0
    assert (side == batch.occupancy.bool()).float().mean() > 0.97


def test_both_shapes_of_a_pair_are_mirrored_alike():
    found = tiny_dataset(augment=AugmentConfig(mirror=True))
    signs = set()
    for step in range(12):
        batch = found.batch(4, 0, step)
        product = batch.source[..., 2] * batch.target[..., 2]
        assert (product[product.abs() > 0.01] > 0).all()
        plain = tiny_dataset(augment=AugmentConfig()).batch(4, 0, step)
        signs.add(torch.allclose(plain.clean_points.mean(), batch.clean_points.mean(), atol=1e-3))
        assert batch.points.isfinite().all()


def test_as_many_queries_are_inside_as_asked_for():
    found = tiny_dataset(queries=2000, augment=AugmentConfig())
    stored = found.occupancies.float().mean()
    assert stored < 0.4
    assert abs(found.batch(6, 0, 0).occupancy.mean() - stored) < 0.03
    stage = Stage(name="any", weights={"occupancy": 1}, steps=1, inside=0.75)
    own = found.for_stage(stage)
    batch = own.batch(6, 0, 0)
    assert (batch.occupancy.mean(1) - 0.75).abs().max() < 0.05
    # Each is a stored one, with the answer that is stored.
    chosen, _ = draw_shapes(own.pools, 6, 0, 0, 0, 1)
    for row, shape in enumerate(chosen.tolist()):
        for of, answer in ((True, 1.0), (False, 0.0)):
            known = found.queries[shape][found.occupancies[shape] == of]
            asked = batch.queries[row][batch.occupancy[row] == answer]
            assert torch.cdist(asked, known).min(1).values.max() < 0.03
    everything = own.plain()["*"].batch(6, 0, 0).occupancy.mean()
    assert abs(everything - stored) < 0.05, "validation asks as they are stored"


@pytest.mark.parametrize(
    ("answer", "share"), [(False, 0.5), (True, 0.5), (False, 1.0), (True, 0.0)]
)
def test_a_shape_that_is_all_inside_or_outside_is_asked_about_what_there_is(answer, share):
    found = tiny_dataset(queries=50, inside=share)
    found.occupancies[:] = answer
    assert (found.batch(4, 0, 0).occupancy == float(answer)).all()


def test_noise_touches_only_what_the_encoder_sees():
    noisy = tiny_dataset(augment=AugmentConfig(noise=0.05, normal_noise=0.2)).batch(4, 0, 0)
    assert (noisy.points - noisy.clean_points).norm(dim=-1).mean() > 0.005
    assert torch.allclose(noisy.normals.norm(dim=-1), torch.ones(4, 64), atol=1e-5)
    assert not torch.allclose(noisy.normals, noisy.clean_normals)


def test_what_pools_refuse():
    shapes = [*balls(4), Ball("real", source="scan")]
    with pytest.raises(ConfigError, match="source 'scan' belong to no pool"):
        tiny_dataset(shapes, pools={"family-*": 1.0})
    with pytest.raises(ConfigError, match="takes 1 of the 1 shapes of pool 'scan'"):
        tiny_dataset(shapes, pools={"family-*": 0.5, "scan": 0.5}).batch(4, 0, 0)
    with pytest.raises(DataError, match="no training shapes"):
        ShapeDataset([], CONFIG)


def test_stored_points_do_not_depend_on_the_other_shapes():
    many, few = tiny_dataset(balls(6)), tiny_dataset(balls(6)[3:])
    assert torch.equal(many.surface[3:], few.surface)


def test_shapes_are_listed_and_loaded_by_split(tmp_path):
    write_folder(tmp_path, balls(6))
    entries = list_shapes([tmp_path])
    assert [entry.split for entry in entries] == ["train"] * 4 + ["val"] * 2
    assert entries[0].licence == "CC0"
    loaded = load_dataset(entries, "val", CONFIG, "cpu")
    assert loaded.names == ["ball-4", "ball-5"] and loaded.groups.names == ["family-ball/200"]
    assert torch.equal(loaded.surface, ShapeDataset(balls(6)[4:], CONFIG).surface)
