"""How a scan stands: proposed, turned by hand, cleaned again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import nrdf
from builders.lying_scan import ANY, lying_scan
from nrdf.bundled import bundled_chair
from nrdf.errors import ProcessError
from nrdf.studio.model.placing import (
    TURNS,
    place_scan,
    removed_points,
    turned,
    with_rotation_of,
)


@pytest.fixture(scope="module")
def placed():
    """That scan, aligned by another chair."""
    reference = bundled_chair("reference")[0]
    return place_scan(lying_scan(), nrdf.load_model("registration"), reference, "scan.ply")


def test_a_scan_in_any_pose_is_found_standing(placed):
    assert placed.scan.unit == placed.cloud.unit == "m"
    assert len(placed.scan) == 4000 and 2000 < len(placed.cloud) <= 2520
    up, front = placed.placement.upright @ ANY[:, 1], placed.placement.upright @ ANY[:, 0]
    assert up[1] > 0.98 and front[0] > 0.95
    assert {step.name: step.removed > 0 for step in placed.placement.steps}["floor"]
    removed = removed_points(placed.scan, placed.cloud)
    assert len(removed) == len(placed.scan) - len(placed.cloud)
    assert placed.placement.poses[-1].probability is None, "that of the file is offered too"


def test_four_quarter_turns_lead_back_and_each_way_is_its_own(placed):
    points, start = placed.cloud.points, placed.placement
    ends = []
    for turn in TURNS:
        there = turned(start, points, turn)
        ends.append(there.upright @ start.upright.T)
        for _ in range(3):
            there = turned(there, points, turn)
        assert there.pose is start.pose
    assert ends[0] @ [1, 0, 0] == pytest.approx([0, 0, 1], abs=1e-9), "the front to the left"
    assert ends[2] @ [0, 1, 0] == pytest.approx([1, 0, 0], abs=1e-9), "the top forward"
    assert ends[4] @ [0, 1, 0] == pytest.approx([0, 0, -1], abs=1e-9), "the top to the right"
    for one, other in zip(ends[::2], ends[1::2], strict=True):
        assert one @ other == pytest.approx(np.eye(3), abs=1e-9)


def test_a_turn_by_hand_outlives_another_cleaning(placed):
    points, found = placed.cloud.points, placed.placement
    assert with_rotation_of(found, found, points) is found
    by_hand = turned(found, points, "Back")
    kept = with_rotation_of(found, by_hand, points)
    assert kept.upright == pytest.approx(by_hand.upright)
    other = replace(found, pose=found.poses[-1])
    assert with_rotation_of(found, other, points).pose is found.poses[-1]


def test_a_unit_that_nothing_tells_or_that_contradicts_is_said():
    model, reference = nrdf.load_model("registration"), bundled_chair("reference")[0]
    with pytest.raises(ProcessError, match="the unit is m, but the file says mm"):
        place_scan(lying_scan(600), model, reference, "scan.ply", "m")
    with pytest.raises(ProcessError, match="does not say its unit: choose one of"):
        place_scan(lying_scan(600, None), model, reference, "scan.ply")
