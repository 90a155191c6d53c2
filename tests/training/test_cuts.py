"""Shapes without one of their ends: what stays, what its box is, what is known of the rest."""

import torch

from builders.tiny_field import Ball, balls, tiny_dataset
from nrdf.training.config import AugmentConfig
from nrdf.training.cuts import draw_cuts

CUT = AugmentConfig(cut=1.0)


def test_every_cut_leaves_one_end_of_an_axis():
    surface = torch.rand(400, 3000, 3, generator=torch.Generator().manual_seed(0)) - 0.5
    cuts = draw_cuts(surface, 0.5, torch.Generator().manual_seed(1))
    keep, kept = cuts.keep(surface), cuts.kept(surface)
    whole = keep.all(1)
    assert 0.4 < whole.float().mean() < 0.6
    share = keep[~whole].float().mean(1)
    assert share.min() > 0.25 and share.max() < 1.0
    sides = kept[~whole].amax(1) - kept[~whole].amin(1)
    assert ((sides < 0.965).sum(1) == 1).all()  # one axis is shorter, the others are as they were
    upper = (cuts.axis == 1) & (cuts.sign > 0)
    assert 0.45 < upper.float().mean() < 0.65
    sides = ~whole & (cuts.axis == 2)
    assert sides.sum() > 20 and kept[sides][..., 2].abs().amax(1).max() < 0.48
    middle = (kept[sides].amax(1) + kept[sides].amin(1))[:, 2]
    assert middle.abs().max() < 0.01  # both ends go alike
    assert torch.equal(cuts.select(torch.tensor([3])).keep(surface[3:4]), keep[3:4])


def test_what_is_left_fills_its_own_box():
    batch = tiny_dataset(balls(count=2000), augment=CUT, surface_points=2000, encoder_points=2000)
    batch = batch.batch(4, 0, 0)
    longest = (batch.clean_points.amax(1) - batch.clean_points.amin(1)).amax(1)
    assert torch.allclose(longest, torch.ones(4), atol=1e-4)
    middle = (batch.clean_points.amax(1) + batch.clean_points.amin(1)) / 2
    assert middle.abs().max() < 1e-4


def test_places_are_asked_of_what_is_left_and_known_to_be_gone_where_it_is_cut():
    shapes = [Ball(f"b{i}", groups=("template-00",)) for i in range(4)]
    gone, there = 0, 0
    for step in range(8):
        batch = tiny_dataset(shapes, augment=CUT, rolls=3).batch(4, 0, step)
        asked = batch.known | (batch.weight > 0)
        low, high = batch.clean_points.amin(1), batch.clean_points.amax(1)
        slack = 0.1  # of the sampled surfaces' boxes
        on = (batch.source >= low[batch.reference, None] - slack).all(-1)
        on &= (batch.source <= high[batch.reference, None] + slack).all(-1)
        assert on[asked].all()
        outside = (batch.target < low[batch.partner, None] - slack).any(-1)
        outside |= (batch.target > high[batch.partner, None] + slack).any(-1)
        assert (batch.weight[outside] == 0).all()
        gone += int((batch.known & (batch.weight == 0)).sum())
        there += int((batch.known & (batch.weight > 0)).sum())
    assert gone > 100 and there > 100


def test_nothing_is_inside_where_it_is_cut_off():
    found = tiny_dataset(balls(count=3000), augment=CUT, queries=400)
    batch = found.batch(4, 0, 1)
    low, high = batch.clean_points.amin(1), batch.clean_points.amax(1)
    beyond = ((batch.queries < low[:, None] - 0.02) | (batch.queries > high[:, None] + 0.02)).any(
        -1
    )
    assert beyond.any() and (batch.occupancy[beyond] == 0).all()
