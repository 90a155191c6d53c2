"""Correspondences that a batch draws: true ones, and places that are known not to exist."""

from __future__ import annotations

from builders.tiny_field import Ball, balls, tiny_dataset
from nrdf.training.config import AugmentConfig
from nrdf.training.pools import draw_shapes


def test_what_the_target_lacks_has_weight_zero_in_exact_groups():
    shapes = [*balls(3), Ball("lacking", missing=True)]
    found = tiny_dataset(shapes, augment=AugmentConfig(), rolls=3)
    none, some = 0, 0
    for step in range(4):
        chosen, _ = draw_shapes(found.pools, 4, 0, step, 0, 1)
        batch = found.batch(4, 0, step)
        for pair in range(len(batch.reference)):
            names = [shapes[chosen[i[pair]]].name for i in (batch.reference, batch.partner)]
            if names[1] == "lacking":
                none += int((batch.weight[pair] == 0).sum())
                some += int((batch.weight[pair] > 0).sum())
                assert batch.known[pair].all()
            else:
                # A source that lacks places has none to ask about.
                assert (batch.weight[pair] == 1).all()
    assert 0.3 < none / (none + some) < 0.7


def test_doubtful_correspondences_are_not_drawn_and_do_not_pass_for_none():
    shapes = [Ball(f"b{i}", groups=("template-00",), missing=i == 0) for i in range(4)]
    batch = tiny_dataset(shapes).batch(4, 0, 0)
    assert (batch.weight > 0).all() and not batch.known.any()


def test_pairs_without_a_common_group_have_no_weight():
    shapes = [Ball(f"b{i}", groups=(f"template-{i // 2}",)) for i in range(4)]
    batch = tiny_dataset(shapes, rolls=3).batch(4, 0, 0)
    joined = (batch.weight > 0).any(dim=1)
    assert joined.sum() == 4 and not joined.all() and not batch.known.any()
    bare = tiny_dataset([Ball(f"b{i}", groups=()) for i in range(4)]).batch(4, 0, 0)
    assert (bare.weight == 0).all() and not bare.known.any() and bare.source.isfinite().all()
