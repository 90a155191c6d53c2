"""Points mapped onto another shape: how far they can be trusted, and how they are moved."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.regions.mapping import TRUST_SCALE, MappedPoints


def test_trust_falls_with_the_expected_error_and_displacements_add_up():
    zero = np.zeros((2, 3))
    mapped = MappedPoints(zero, zero, np.array([1.0, 0.5]), np.array([TRUST_SCALE, 0.0]), zero)
    np.testing.assert_allclose(mapped.trust, [np.exp(-1), 0.5])
    moved = mapped.displaced(np.ones((2, 3))).displaced(np.ones((2, 3)))
    assert (moved.points == 2).all() and (moved.displacement == 2).all()
    assert moved.select(np.array([1])).existence == pytest.approx([0.5])
