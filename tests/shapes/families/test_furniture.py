"""What chairs and tables share."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.shapes.families.base import SIDE
from nrdf.shapes.families.furniture import LegStyle, Stand, bar, pick


def stand() -> Stand:
    """Four legs that splay a little."""
    foot = {"front": np.array([0.3, 0.0, 0.25]), "rear": np.array([-0.3, 0.0, 0.25])}
    top = {"front": np.array([0.2, 0.5, 0.2]), "rear": np.array([-0.2, 0.5, 0.2])}
    return Stand(foot, top, LegStyle((0.02, 0.02), 2.0, 0.02))


def skin(part, count: int = 16) -> np.ndarray:
    """Points of a part's side."""
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(0, 1, count), np.linspace(0, 1, count)))
    return part.points(np.full(len(u), SIDE), u, v)


def test_names_are_picked_by_their_weight() -> None:
    rng = np.random.default_rng(0)
    picked = [pick(rng, {"often": 3.0, "seldom": 1.0, "never": 0.0}) for _ in range(2000)]
    assert picked.count("often") / 2000 == pytest.approx(0.75, abs=0.04)
    assert "never" not in picked


def test_a_bar_runs_from_point_to_point() -> None:
    points = skin(bar("b", 1, (0.0, 0.0, 0.0), (0.1, 1.0, 0.2), (0.01, 0.02)))
    np.testing.assert_allclose(points[points[:, 1] == 0.0].mean(axis=0), [0, 0, 0], atol=0.01)
    np.testing.assert_allclose(points[points[:, 1] == 1.0].mean(axis=0), [0.1, 1, 0.2], atol=0.01)


def test_legs_stand_on_the_floor_and_are_mirrored() -> None:
    right, left = stand().leg("front")
    assert (right.slot, left.slot) == ("leg-right-front", "leg-left-front")
    np.testing.assert_allclose(skin(left), skin(right) * [1, 1, -1])
    assert skin(right)[:, 1].min() == 0.0
    np.testing.assert_allclose(stand().at_height("front", 0.25), [0.25, 0.25, 0.225])


def test_rails_join_the_legs() -> None:
    rails = {r.slot: r for r in stand().rails("stretcher", {"left": 0.1, "rear": 0.2}, (0.01,) * 2)}
    assert set(rails) == {"stretcher-left", "stretcher-right", "stretcher-rear"}
    rear = skin(rails["stretcher-rear"])
    assert rear[:, 1].mean() == pytest.approx(0.2, abs=0.01)
    assert np.ptp(rear[:, 2]) == pytest.approx(2 * stand().at_height("rear", 0.2)[2])
