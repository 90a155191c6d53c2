"""Cleaning leaves the object, says what it removed, and takes no part of the object for a floor."""

from __future__ import annotations

import numpy as np
import pytest

from builders.scenes import UP, pose, scan_of
from nrdf.errors import CloudError
from nrdf.io.cloud import PointCloud
from nrdf.scans.clean import MOST_POINTS, STEPS, clean_scan, unthinned

CHAIR = 1_000_004
FLOOR_ONLY = np.random.default_rng(0).uniform([-2, -2, 0], [2, 2, 1e-3], (5000, 3))


def shares(scan, cleaned) -> tuple[float, float]:
    """Share of the object's points that was lost; floor's points that are left, as a share."""
    kept = np.zeros(len(scan.face), bool)
    kept[cleaned.kept] = True
    of_object = scan.face >= 0
    return (~kept & of_object).sum() / of_object.sum(), (kept & ~of_object).mean()


@pytest.mark.parametrize("views", [1, 3])
@pytest.mark.parametrize("up", [UP, None])
def test_the_floor_goes_and_the_object_stays(views, up):
    place = pose(2.0, 300.0, (40, -7, 1000))
    scan = scan_of("chair", CHAIR, place, views, floor=True)
    cleaned = clean_scan(scan.cloud, up)
    lost, left = shares(scan, cleaned)
    assert lost < 0.03 and left == 0
    np.testing.assert_allclose(cleaned.floor.normal, UP, atol=0.01)
    ground = scan.cloud.points[scan.face < 0] @ UP
    assert abs(cleaned.floor.offset - np.median(ground)) < 0.01 * 300
    np.testing.assert_array_equal(cleaned.cloud.points, scan.cloud.points[cleaned.kept])
    step = {step.name: step for step in cleaned.steps}["floor"]
    assert step.removed >= (scan.face < 0).sum() and "carries the rest" in step.note


def test_the_larger_of_two_objects_is_kept():
    one, two = (
        scan_of("chair", seed, pose(yaw, 1.0, (2 * x, 0, 0))).cloud.points
        for seed, yaw, x in ((CHAIR, 0.3, 0), (1_000_003, 2.0, 1))
    )
    cleaned = clean_scan(PointCloud(np.vstack([one, two])), UP)
    assert cleaned.others == 1
    other = clean_scan(PointCloud(np.vstack([one, two])), UP, number=1)
    assert not set(other.kept) & set(cleaned.kept) and "number 2 of 2" in other.steps[-1].note
    with pytest.raises(CloudError, match="there is no object 3: the scan has 2"):
        clean_scan(PointCloud(np.vstack([one, two])), UP, number=2)
    kept = cleaned.kept < len(one)
    assert kept.mean() in (0.0, 1.0), "all of one chair"
    assert "largest of 2 objects" in cleaned.steps[-1].note
    both = clean_scan(PointCloud(np.vstack([one, two])), UP, skip=["objects"])
    assert len(both.kept) > 0.99 * (len(one) + len(two)) and both.others == 0


def test_a_small_thing_beside_the_object_is_no_second_object():
    chair = scan_of("chair", CHAIR).cloud.points
    cup = np.random.default_rng(0).uniform([1.45, -0.05, 0], [1.55, 0.05, 0.1], (300, 3))
    cleaned = clean_scan(PointCloud(np.vstack([chair, cup])), UP)
    assert cleaned.others == 0 and cleaned.kept.max() < len(chair)


def test_parts_that_only_the_view_separates_stay_together():
    chair = scan_of("chair", CHAIR, pose(0.0)).cloud.points
    height = chair @ UP
    gap = (height > -0.3) & (height < 0.0)  # most of the legs was not seen
    cleaned = clean_scan(PointCloud(chair[~gap]), UP)
    assert (chair[~gap][cleaned.kept] @ UP < -0.3).any()


def test_outliers_and_duplicates_go():
    chair = scan_of("chair", CHAIR).cloud
    lonely = np.random.default_rng(1).uniform(-1.5, 1.5, (60, 3))
    points = np.vstack([chair.points, chair.points[:500], lonely])
    cleaned = clean_scan(PointCloud(points), UP)
    removed = {step.name: step.removed for step in cleaned.steps}
    assert removed["duplicates"] == 500
    assert (cleaned.kept >= len(chair)).sum() <= 3, "lonely points, or repeated ones"
    assert (cleaned.kept < len(chair)).sum() > 0.995 * len(chair)
    everything = clean_scan(PointCloud(points), UP, skip=STEPS)
    np.testing.assert_array_equal(everything.kept, np.arange(len(points)))


def test_a_slanted_view_is_not_taken_for_outliers():
    car = scan_of("car", 1_000_001, views=1).cloud
    removed = {s.name: s.removed for s in clean_scan(car, UP).steps}
    assert removed["outliers"] < 0.01 * len(car)


def test_all_that_belongs_to_a_point_goes_with_it():
    scan = scan_of("chair", CHAIR, floor=True).cloud
    intensity = np.arange(len(scan), dtype=np.float32)
    cloud = PointCloud(scan.points, unit="mm", intensity=intensity, sensors=scan.sensors)
    cleaned = clean_scan(cloud, UP)
    np.testing.assert_array_equal(cleaned.cloud.intensity, cleaned.kept)
    np.testing.assert_array_equal(cleaned.cloud.sensors, scan.sensors)
    assert cleaned.cloud.unit == "mm"


def test_a_scan_of_many_points_is_thinned():
    chair = scan_of("chair", CHAIR).cloud.points
    rng = np.random.default_rng(0)
    many = np.repeat(chair, MOST_POINTS // len(chair) + 2, axis=0)
    many += 1e-3 * rng.normal(size=many.shape)
    cleaned = clean_scan(PointCloud(many), UP)
    assert cleaned.steps[0].name == "thin"
    assert cleaned.steps[0].removed == len(many) - MOST_POINTS
    assert 0.95 * MOST_POINTS < len(cleaned.kept) <= MOST_POINTS
    everything = clean_scan(PointCloud(many), UP, skip=["thin"])
    assert len(everything.kept) > 0.95 * len(many)
    far = np.concatenate([many, [[9.0, 9.0, 9.0]]])  # an outlier is no point between others
    whole = unthinned(PointCloud(many), cleaned), unthinned(PointCloud(far), cleaned)
    assert len(whole[0]) == len(whole[1]) > 0.99 * len(many)
    assert unthinned(PointCloud(many), everything) is everything.cloud


def test_a_scan_of_nothing_but_floor_is_refused():
    with pytest.raises(CloudError, match=r"the step 'floor' removed 5000 .* --skip floor leaves"):
        clean_scan(PointCloud(FLOOR_ONLY), UP)


def test_unknown_steps_are_refused():
    with pytest.raises(CloudError, match="no step of cleaning 'wall'; known: thin, duplicates"):
        clean_scan(PointCloud(FLOOR_ONLY), UP, skip=["wall"])
