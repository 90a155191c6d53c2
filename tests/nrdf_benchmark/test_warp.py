"""The score of warped waypoints: exact where the target is the reference itself."""

from __future__ import annotations

import numpy as np
import pytest

import nrdf
from nrdf.errors import DataError
from nrdf.shapes.families import get_family
from nrdf_benchmark import warp
from nrdf_benchmark.warp import WarpResult, evaluate_warp


class OneTable:
    """A family whose members are all the same."""

    def __init__(self):
        self._family = get_family("table")
        self._member = self._family.member(3)
        self.region_names, self.region_of = self._family.region_names, self._family.region_of

    def member(self, seed):
        return self._member


@pytest.fixture
def small(monkeypatch):
    monkeypatch.setattr(warp, "CLOUD_POINTS", 2000)
    monkeypatch.setattr(warp, "_TRUTH_POINTS", 8000)


def test_a_reference_warped_to_itself_is_exact(small, untrained, monkeypatch):
    monkeypatch.setattr(warp, "get_family", lambda name: OneTable())
    model = nrdf.load_model(untrained)
    model.metadata["category"] = "table"
    told = []
    found = evaluate_warp(model, "table", 1, lambda *now: told.append(now))
    assert told == [(1, 1)] and found.category == "table"
    assert np.median(found.errors[0]) < 0.01 and found.medians.shape == (1,)
    assert len(found.errors[0]) > 100 and found.lost < 0.1
    assert found.present.all() and found.kept(0.01, present=True) == 1.0


def test_shares_of_what_is_found():
    confidence, present = np.array([0.9, 0.2, 0.5, 0.1]), np.array([True, True, False, False])
    found = WarpResult("chair", (np.array([0.1, 0.3, 0.2]),), 0.0, 0.0, confidence, present)
    assert found.kept(0.3, present=True) == found.kept(0.3, present=False) == 0.5
    assert np.isnan(WarpResult("x", (), 0, 0, confidence, ~present & present).kept(0.3, True))
    assert found.medians[0] == 0.2


def test_nothing_to_do_and_unknown_categories_are_refused(untrained):
    model = nrdf.load_model(untrained)
    with pytest.raises(DataError, match="0 pairs asked for"):
        evaluate_warp(model, "chair", 0)
    with pytest.raises(DataError, match="no family 'lamp'"):
        evaluate_warp(model, "lamp")
