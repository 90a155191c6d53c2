"""C of the general field: where it begins, both ways as one batch, and one look after the other."""

from __future__ import annotations

import torch

from nrdf.field.pair_inverse import PairInverse, Tokens, half_way

STRETCH = torch.tensor([1.0, 0.7, 1.0])


def tokens(seed: int, scale: torch.Tensor) -> Tokens:
    generator = torch.Generator().manual_seed(seed)
    points = (torch.rand(2, 30, 3, generator=generator) - 0.5) * scale
    normals = torch.nn.functional.normalize(points, dim=-1)
    features = torch.randn(2, 30, 8, generator=generator)
    return Tokens(points, normals, features, points.amin(1), points.amax(1))


def inverse() -> PairInverse:
    torch.manual_seed(0)
    return PairInverse(8, width=16, heads=2, looks=3).eval()


def test_the_search_begins_half_way_to_the_bounding_box():
    one = tokens(0, torch.ones(3))
    other = Tokens(one.points * STRETCH, *one[1:3], one.low * STRETCH, one.high * STRETCH)
    begun = half_way(one.points, one, other)
    torch.testing.assert_close(begun, one.points * (1 + STRETCH) / 2, atol=1e-5, rtol=0)


def test_both_ways_are_one_batch():
    one, other = tokens(0, torch.ones(3)), tokens(1, STRETCH)
    there, back = inverse()(one, other)
    again, turned = inverse()(other, one)
    torch.testing.assert_close(there.points, turned.points)
    torch.testing.assert_close(back.matches, again.matches)
    torch.testing.assert_close(there.matches.exp().sum(-1), torch.ones(2, 30))


def test_each_look_goes_on_from_the_one_before_and_learns_alone():
    network = inverse()
    there, _ = network(tokens(0, torch.ones(3)), tokens(1, STRETCH))
    assert len(there.looks) == 4 and torch.equal(there.looks[-1], there.points)
    assert not torch.allclose(there.looks[0], there.looks[1])
    there.looks[0].sum().backward()
    first, second = network.looks[0].offset, network.looks[1].offset
    assert first.bias.grad is not None and second.bias.grad is None
