"""Pairs of a batch, and the random numbers that it is drawn with."""

from __future__ import annotations

import torch

from builders.tiny_field import tiny_dataset
from nrdf.training.batch import pair_up, seeded


def test_no_shape_is_its_own_partner():
    for rolls in (1, 2, 5):
        for size in (2, 3, 6):
            batch = tiny_dataset(rolls=rolls).batch(size, 0, 1)
            assert (batch.reference != batch.partner).all()
            assert batch.partner[:size].sort().values.tolist() == list(range(size))


def test_shapes_are_paired_within_their_pool():
    reference, partner = pair_up([3, 2], 2, torch.device("cpu"))
    assert reference.tolist() == [0, 1, 2, 3, 4] * 2
    assert partner.tolist() == [1, 2, 0, 4, 3, 2, 0, 1, 4, 3]


def test_generators_differ_by_any_of_their_keys():
    device = torch.device("cpu")
    draws = [torch.rand(1, generator=seeded(device, *keys)) for keys in ((1, 2), (2, 1), (1, 3))]
    assert len({float(value) for value in draws}) == 3
    assert torch.equal(draws[0], torch.rand(1, generator=seeded(device, 1, 2)))
