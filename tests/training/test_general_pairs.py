"""Pairs for the general field: true places are on the other shape, and what is gone is known."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from nrdf.training import general_pairs
from nrdf.training.general_pairs import draw_pairs, make_pool


@pytest.fixture(scope="module")
def pool():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(general_pairs, "POINTS", 256)
        rng = np.random.default_rng(0)
        ball = rng.normal(size=(2, 400, 3))
        ball /= np.linalg.norm(ball, axis=2, keepdims=True)
        yield make_pool([(one / 2, one) for one in ball], 2, ("chair",), 1, 0)


@pytest.fixture
def pairs(pool):
    return draw_pairs(pool, 8, torch.Generator().manual_seed(0))


def test_a_batch_is_canonical_and_comes_again(pool, pairs):
    for side in pairs:
        size = side.points.amax(1) - side.points.amin(1)
        assert torch.allclose(size.amax(1), torch.ones(8), atol=0.06)  # with noise
        torch.testing.assert_close(side.normals.norm(dim=-1), torch.ones(8, 256))
    again = draw_pairs(pool, 8, torch.Generator().manual_seed(0))
    assert all(torch.equal(a, b) for a, b in zip(pairs[0], again[0], strict=True))


def test_true_places_lie_on_the_other_shape(pairs):
    for side, other in (pairs, pairs[::-1]):
        nearest = torch.cdist(side.true_points, other.points).amin(2)
        assert float(nearest[side.exists > 0].median()) < 0.06


def test_two_deformations_of_one_surface_face_alike(pairs):
    surfaces = slice(4, None)
    side = pairs[0]
    facing = (side.normals * side.true_normals).sum(-1)[surfaces]
    assert float(facing[side.exists[surfaces] > 0].median()) > 0.8


def test_cuts_and_growths_are_known_not_to_exist(pool, monkeypatch):
    monkeypatch.setattr(general_pairs, "_CUT", 1.0)
    monkeypatch.setattr(general_pairs, "_GROWN", 1.0)
    cut = draw_pairs(pool, 8, torch.Generator().manual_seed(0))
    monkeypatch.setattr(general_pairs, "_CUT", 0.0)
    monkeypatch.setattr(general_pairs, "_GROWN", 0.0)
    whole = draw_pairs(pool, 8, torch.Generator().manual_seed(0))
    surfaces = slice(4, None)
    assert float(whole[0].exists[surfaces].mean()) == 1.0
    assert float(cut[0].exists[surfaces].mean()) < 0.9
