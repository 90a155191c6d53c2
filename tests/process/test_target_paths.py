"""Processes on a target that is the reference itself, and one a little larger."""

from __future__ import annotations

import numpy as np
import pytest

import nrdf
from builders.taught_box import SAND, SIZE, bound_knowledge, solid
from nrdf.process.transfer import ProcessTransfer


@pytest.fixture(scope="module")
def model(untrained):
    return nrdf.load_model(untrained)


def on_larger(model, processes):
    told = []
    transfer = ProcessTransfer(bound_knowledge({"top": processes}, solid()), model)
    result = transfer.transfer(solid(1.2 * SIZE), progress=lambda *now: told.append(now))
    return result, told


def test_planned_and_warped_paths_lie_on_the_targets_mesh(model):
    result, told = on_larger(model, [SAND, {**SAND, "transfer": "warp"}])
    assert told == [(1, 3), (2, 3)]
    for step in result.paths:
        work = [s for s in step.path.segments if s.kind == "process"]
        np.testing.assert_allclose(
            np.concatenate([s.positions for s in work])[:, 1], 0.36, atol=1e-6
        )
        assert step.metrics.true_distance_worst_m < 1e-6
        assert step.metrics.coverage > 0.9
    planned, warped = (step.metrics.line_spacing_mean_m for step in result.paths)
    assert planned == pytest.approx(0.04, rel=0.1)
    assert warped == pytest.approx(1.2 * planned, rel=0.1)  # the reference's lines, stretched


def test_a_path_that_cannot_be_planned_has_a_reason_and_does_not_stop_the_others(model):
    result, _ = on_larger(model, [{**SAND, "edge_margin_mm": 900}, SAND])
    wrong, right = result.paths
    assert "edge_margin_m is 0.9" in wrong.reason and wrong.path is None
    assert right.reason == "" and right.path is not None
