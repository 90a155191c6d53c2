"""Correspondence error against exact truth."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from builders.small_model import SMALL
from nrdf.errors import DataError
from nrdf.field import build_field
from nrdf.regions.model import Model
from nrdf_benchmark import families as module
from nrdf_benchmark.families import FamilyResult, evaluate_family


@pytest.fixture(scope="module")
def model() -> Model:
    torch.manual_seed(0)
    return Model(build_field("default", SMALL), {"category": "table"})


@pytest.fixture(autouse=True)
def small(monkeypatch):
    monkeypatch.setattr(module, "CLOUD_POINTS", 600)
    monkeypatch.setattr(module, "COMPARED_POINTS", 200)


def test_the_ratio_is_of_the_means():
    result = FamilyResult("x", np.array([0.1, 0.3]), np.array([0.5, 1.1]), np.ones(2))
    assert result.ratio == pytest.approx(4.0)


def test_an_untrained_field_is_about_as_good_as_the_copy(model):
    told = []
    result = evaluate_family(model, "table", 3, lambda *a: told.append(a))
    assert told == [(1, 3), (2, 3), (3, 3)]
    assert result.field.shape == result.box.shape == result.shared.shape == (3,)
    assert ((result.shared > 0) & (result.shared <= 1)).all()
    assert ((result.box > 0.001) & (result.box < 0.3)).all()
    assert 0.3 < result.ratio < 1.2  # it starts half-way to the box copy
    again = evaluate_family(model, "table", 2)
    np.testing.assert_array_equal(again.field, result.field[:2])


def test_the_error_is_zero_for_a_field_that_knows(model, monkeypatch):
    """Members compared with themselves: then the truth is the identity, which C starts with."""
    family = module.get_family("table")

    class Same:
        def member(self, seed):
            return family.member(seed // 2)

    monkeypatch.setattr(module, "get_family", lambda name: Same())
    monkeypatch.setattr(module, "CLOUD_POINTS", 3000)
    result = evaluate_family(model, "table", 2)
    # The clouds are two draws, whose boxes differ by the spacing of their points.
    assert (result.field < 0.008).all() and (result.shared > 0.99).all()


def test_what_cannot_be_measured_is_refused(model):
    with pytest.raises(DataError, match="0 pairs asked for"):
        evaluate_family(model, "table", 0)
    with pytest.raises(DataError, match="no family 'boat'"):
        evaluate_family(model, "boat", 1)
