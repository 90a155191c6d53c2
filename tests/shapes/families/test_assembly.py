"""Random kinds: members differ, share places, and mirrored parts are mirrored."""

from __future__ import annotations

import numpy as np

from nrdf.shapes.families.assembly import Kind


def test_members_of_a_kind_differ_and_share_their_places():
    shares = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        kind = Kind(rng)
        one, other = kind.member(rng), kind.member(rng)
        sample = one.sample_surface(300, rng)
        found = other.locate(sample.coordinates)
        shares.append(found.exists.mean())
        again = one.locate(sample.coordinates)
        np.testing.assert_allclose(again.points, sample.points, atol=1e-9)
        moved = np.linalg.norm(found.points - sample.points, axis=1)[found.exists]
        assert not len(moved) or moved.mean() > 0.005
        assert np.ptp(sample.points, axis=0).max() <= 1.001
    assert np.mean(shares) > 0.5


def test_kinds_are_not_alike_and_the_same_seed_gives_the_same():
    slots = {Kind(np.random.default_rng(seed)).slots for seed in range(8)}
    assert len(slots) > 3
    first, again = (Kind(np.random.default_rng(3)).member(np.random.default_rng(4)) for _ in "ab")
    np.testing.assert_array_equal(first.centre, again.centre)


def test_paired_parts_are_mirror_images():
    for seed in range(20):
        rng = np.random.default_rng(seed)
        kind = Kind(rng)
        member = kind.member(rng)
        for part in member.parts:
            if not part.slot.endswith("-1"):
                continue
            twin = next(p for p in member.parts if p.slot == part.slot[:-1] + "0")
            face, at = np.zeros(20, int), rng.random((2, 20))
            points, images = (p.points(face, *at) * member.scale + member.centre
                              for p in (twin, part))  # fmt: skip
            np.testing.assert_allclose(images, points * [1, 1, -1], atol=1e-9)
            return
    raise AssertionError("no kind with paired parts")
