"""Curves of bodywork."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.shapes.families.bodywork import SIDE_V, TOP_V, filleted, ramp


def test_fillets_round_corners_only() -> None:
    curve = filleted([0, 1, 2], [0, 1, 0], [0.2])
    np.testing.assert_allclose(curve(np.array([0.0, 0.5, 0.8, 1.2, 2.0])), [0, 0.5, 0.8, 0.8, 0])
    assert curve(np.array([1.0]))[0] == pytest.approx(0.9)
    np.testing.assert_allclose(ramp(np.array([-1.0, 0.0, 1.0]), 0.4), [0, 0.1, 1])


def test_knots_of_the_profile_and_of_the_sides_rise_from_tail_to_nose() -> None:
    for knots in (TOP_V, SIDE_V):
        assert (np.diff(knots) > 0).all()
        assert knots[[0, -1]].tolist() == [0.0, 1.0]
