"""Pools: which shapes meet in a batch, and in what shares."""

from __future__ import annotations

import pytest
import torch

from builders.tiny_field import Ball, balls, tiny_dataset
from nrdf.errors import ConfigError
from nrdf.training.config import Stage
from nrdf.training.pools import draw_shapes


def test_an_epoch_shows_every_shape_once_over_all_ranks():
    found = tiny_dataset()
    assert found.steps_per_epoch(2) == 3
    seen = torch.cat([draw_shapes(found.pools, 2, 5, step, 0, 1)[0] for step in range(3)])
    assert sorted(seen.tolist()) == list(range(6))
    again = torch.cat([draw_shapes(found.pools, 2, 5, step, 0, 1)[0] for step in range(3, 6)])
    assert sorted(again.tolist()) == list(range(6)) and again.tolist() != seen.tolist()
    ranks = torch.cat([draw_shapes(found.pools, 2, 5, 0, rank, 3)[0] for rank in range(3)])
    assert sorted(ranks.tolist()) == list(range(6))


def test_pools_share_a_batch_and_pair_within_themselves():
    shapes = [*balls(6), *(Ball(f"real-{i}", source="scan") for i in range(3))]
    found = tiny_dataset(shapes, pools={"family-*": 0.6, "*": 0.4}, rolls=2)
    assert found.pool_sizes(5) == [3, 2]
    batch = found.batch(5, 0, 0)
    assert ((batch.reference < 3) == (batch.partner < 3)).all()
    # A pool that is smaller than its share gives what it has.
    assert found.pool_sizes(20) == [6, 3]


def test_a_stage_has_pools_and_numbers_of_points_of_its_own():
    shapes = [Ball(f"{kind}-{i}", source=kind) for kind in ("family", "scan") for i in range(4)]
    found = tiny_dataset(shapes, pools={"family": 0.25, "*": 0.75}, queries=16)
    stage = Stage(name="any", weights={"occupancy": 1}, steps=1)
    plain, own = found.batch(8, 0, 0), found.for_stage(stage).batch(8, 0, 0)
    assert torch.equal(plain.points, own.points) and torch.equal(plain.queries, own.queries)
    other = found.for_stage(
        stage.model_copy(
            update={"pools": {"scan": 0.25, "*": 0.75}, "encoder_points": 9, "queries": 5}
        )
    )
    sources = [shapes[i].source for i in draw_shapes(other.pools, 8, 0, 0, 0, 1)[0].tolist()]
    assert sources.count("scan") == 2 and sources.count("family") == 4
    batch = other.batch(8, 0, 0)
    assert batch.points.shape[1] == 9 and batch.queries.shape[1] == 5
    assert found.pool_sizes(8) == [2, 4], "the run's own pools stay"
    assert found.batch(8, 0, 0).queries.shape[1] == 16, "and its numbers"
    with pytest.raises(ConfigError, match="source 'scan' belong to no pool"):
        found.for_stage(stage.model_copy(update={"pools": {"family": 1.0}}))
