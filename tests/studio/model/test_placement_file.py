"""How an object stands, in a session's file: read as it was written, refused where damaged."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError

from nrdf.geometry.similarity import Similarity, up_axis, upright
from nrdf.scans.clean import Step
from nrdf.studio.model.placement_file import PlacementContent
from nrdf.studio.model.placing import Placement, Pose, turned

POINTS = np.random.default_rng(0).uniform(-1, 1, (50, 3))


def placement():
    poses = tuple(
        Pose(Similarity(upright(up_axis(up)), np.array([0.1, 0.2, 0.3]), 0.9), share, 0.6)
        for up, share in (("z", 0.8), ("y", None))
    )
    steps = (Step("floor", 70, "a plane"), Step("objects", 0, "one object"))
    return Placement(poses[0], poses, steps, ("objects",), 1, 2, ("two objects",))


def test_it_is_read_as_it_was_written():
    given = placement()
    text = PlacementContent.of(given).model_dump_json()
    read = PlacementContent.model_validate_json(text).placement()
    assert PlacementContent.of(read).model_dump_json() == text
    assert read.pose is read.poses[0] and np.array_equal(read.upright, given.upright)
    by_hand = turned(given, POINTS, "Left")
    read = PlacementContent.of(by_hand).placement()
    assert not any(pose is read.pose for pose in read.poses)
    assert read.upright == pytest.approx(by_hand.upright)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"skipped": ["thin"]}, "skipped: must be of floor, outliers, objects"),
        ({"poses": []}, "at least 1"),
        ({"number": -1}, "greater than or equal to 0"),
        ({"tilt": 3}, "Extra inputs"),
    ],
)
def test_what_is_damaged_is_refused(change, said):
    content = PlacementContent.of(placement()).model_dump(mode="json")
    with pytest.raises(ValidationError, match=said):
        PlacementContent.model_validate({**content, **change})
    content["pose"]["rotation"] = [[1, 0, 0], [0, 1, 0], [0, 0, -1]]
    with pytest.raises(ValidationError, match="orthonormal and right-handed"):
        PlacementContent.model_validate(content)
