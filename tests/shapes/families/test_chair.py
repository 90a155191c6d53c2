"""Chairs."""

from __future__ import annotations

import numpy as np

from nrdf.shapes.families import get_family


def test_chair_regions_face_the_right_way() -> None:
    chair = get_family("chair")
    for seed in range(20):
        sample = chair.member(seed).sample_surface(2048, np.random.default_rng(0))
        region = chair.region_of(sample.coordinates)
        assert np.median(sample.normals[region == "seat", 1]) > 0.8
        # a tub's back wraps around the sitter, so its front faces sideways as well
        assert sample.normals[region == "back-front", 0].mean() > 0.3
        assert sample.normals[region == "back-back", 0].mean() < -0.3
        front, rear = (sample.points[region == f"back-{side}", 0] for side in ("front", "back"))
        assert front.mean() > rear.mean()
        assert sample.points[region == "seat", 0].mean() > front.mean()
        for name in ("arm-left", "arm-right"):
            if (region == name).sum() > 20:
                assert np.median(sample.normals[region == name, 1]) > 0.7


def test_arms_as_high_as_the_wings_leave_them_out() -> None:
    member = get_family("chair").member(1610384486)
    slots = {part.slot for part in member.parts}
    assert "arm-right" in slots and "wing-right" not in slots
