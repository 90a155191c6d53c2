"""Metrics of a result."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.errors import ProcessError
from nrdf.process_model.result import Target, measure_result


def test_figures_are_by_area():
    values = np.array([40e-6, 60e-6, 80e-6])
    areas = np.array([1.0, 2.0, 1.0])
    found = measure_result(values, areas, Target(60e-6, 10e-6), 480e-6, 24e-6, 5.0)
    assert found.mean_m == pytest.approx(60e-6)
    assert found.variation == pytest.approx(np.sqrt(200.0) / 60.0)
    assert (found.within, found.below, found.above) == pytest.approx((0.5, 0.25, 0.25))
    assert found.overspray == pytest.approx(0.5) and found.beside == pytest.approx(0.05)
    assert (found.least_m, found.most_m) == (40e-6, 80e-6)


def test_a_pad_wastes_nothing():
    assert measure_result(np.ones(1), np.ones(1), Target(60e-6, 10e-6)).overspray == 0.0


@pytest.mark.parametrize(
    ("value", "tolerance", "said"),
    [(0.0, 1e-6, "a target of 0"), (6e-5, 6e-5, "a tolerance of 60 µm on 60"), (6e-5, 0.0, "of 0")],
)
def test_targets_that_mean_nothing_are_refused(value, tolerance, said):
    with pytest.raises(ProcessError, match=said):
        Target(value, tolerance)
