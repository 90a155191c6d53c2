"""A simulation's result in words."""

from __future__ import annotations

import json

import pytest


def test_verdicts_in_words(playback):
    pytest.importorskip("viser", reason="pip install 'nrdf[studio]'")
    from nrdf.studio.panels.robot import summary

    report = json.loads(json.dumps(playback.report, default=float))
    assert "**100.0%** of 27 waypoints reached, **no** moves with a collision" in summary(report)
    assert "Red points" not in summary(report)
    (path,) = report["paths"]
    path["verdicts"] |= {"reached": 20, "singular": 3, "too fast": 4}
    path["collisions"] = [{"what": "floor", "depth_m": 0.0123}]
    text = summary(report)
    assert "⚠ **top**, not reached: 3 singular, 4 too fast." in text
    assert "*singular*: at a singularity" in text and "*limit*" not in text
    assert "⚠ **top**: 1 move collides, with the floor by up to 12.3 mm" in text
