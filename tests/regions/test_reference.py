"""Retrieval with an untrained field, whose C puts a shape's points exactly onto the same shape."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from scipy.spatial import cKDTree

from builders.small_model import COUNT, build, build_doubtful, chair
from nrdf.errors import RegionError
from nrdf.field.cloud_encoder import WORKING_POINTS
from nrdf.geometry.canonical import rotation_about_up
from nrdf.geometry.similarity import Similarity, up_axis, upright
from nrdf.io.cloud import PointCloud
from nrdf.process.transfer_result import MIN_CONFIDENCE
from nrdf.regions.model import Model
from nrdf.regions.reference import EncodedReference

OFFSET = np.array([200.0, -4000.0, 50.0])


@pytest.fixture(scope="module")
def model() -> Model:
    return build()


@pytest.fixture(scope="module")
def reference():
    return chair()


@pytest.fixture(scope="module")
def taught(model, reference):
    return model.set_reference(reference[0])


def overlap(found: np.ndarray, mask: np.ndarray) -> float:
    """Intersection over union."""
    other = np.zeros(len(mask), bool)
    other[found] = True
    return (other & mask).sum() / (other | mask).sum()


def check(match, count: int) -> None:
    """What holds for every match."""
    assert match.indices.dtype.kind == "i" and (np.diff(match.indices) > 0).all()
    assert len(match.indices) == 0 or (match.indices[0] >= 0 and match.indices[-1] < count)
    assert match.confidence.shape == match.indices.shape
    assert (match.confidence >= 0).all() and (match.confidence <= 1).all()
    assert np.isfinite(match.points).all()


@pytest.mark.parametrize("method", ["mask", "points"])
def test_on_the_reference_itself_regions_are_found_again(taught, reference, method):
    cloud, masks = reference
    matches = taught.retrieve_all(masks, cloud, method)
    assert list(matches) == list(masks)
    for name, match in matches.items():
        check(match, COUNT)
        assert match.method == method
        assert overlap(match.indices, masks[name]) > (0.9 if method == "mask" else 0.999)
        np.testing.assert_allclose(match.points, cloud.points[masks[name]], atol=1e-5)
        assert 0.7 < match.score <= match.presence.overlap + 1e-9


@pytest.mark.parametrize("method", ["mask", "points"])
def test_raw_points_are_one_for_each_region_point_in_order(taught, reference, method):
    cloud, _ = reference
    region = np.random.default_rng(0).permutation(COUNT)[:100]
    match = taught.retrieve(region, cloud, method)
    np.testing.assert_allclose(match.points, cloud.points[region], atol=1e-5)
    as_points = taught.retrieve(cloud.points[region], cloud, method)
    np.testing.assert_array_equal(as_points.points, match.points)
    np.testing.assert_array_equal(as_points.indices, match.indices)


@pytest.mark.parametrize("method", ["mask", "points"])
def test_results_are_in_the_targets_own_coordinates(taught, reference, method):
    cloud, masks = reference
    moved = PointCloud(1000.0 * cloud.points + OFFSET, cloud.normals, unit="mm")
    match = taught.retrieve(masks["seat"], moved, method)
    np.testing.assert_allclose(match.points, moved.points[masks["seat"]], atol=0.01)
    same = taught.retrieve(masks["seat"], cloud, method)
    assert overlap(same.indices, np.isin(np.arange(COUNT), match.indices)) > 0.99


def test_a_reference_may_have_any_scale_too(model, reference):
    cloud, masks = reference
    far = PointCloud(1000.0 * cloud.points + OFFSET, cloud.normals)
    match = model.set_reference(far).retrieve(far.points[masks["seat"]], cloud)
    np.testing.assert_allclose(match.points, cloud.points[masks["seat"]], atol=1e-4)
    assert overlap(match.indices, masks["seat"]) > 0.9


@pytest.mark.parametrize("method", ["mask", "points"])
def test_another_chair_is_searched(reference, method):
    taught = build_doubtful().set_reference(reference[0])
    target, truth = chair(seed=5)
    matches = taught.retrieve_all(reference[1], target, method)
    for match in matches.values():
        check(match, COUNT)
    assert overlap(matches["seat"].indices, truth["seat"]) > 0.1
    here = taught.retrieve_all(reference[1], reference[0], method)
    assert matches["seat"].score < here["seat"].score


def test_front_and_back_of_a_backrest_are_kept_apart(model, reference):
    cloud, masks = reference
    other, truth = chair(draw=1)
    matches = model.set_reference(cloud).retrieve_all(masks, other)
    for name, against in (("back-front", "back-back"), ("back-back", "back-front")):
        assert overlap(matches[name].indices, truth[name]) > 0.8
        assert truth[against][matches[name].indices].mean() < 0.05


def test_normals_are_estimated_where_there_are_none(model, reference):
    cloud, masks = reference
    bare = PointCloud(cloud.points)
    match = model.set_reference(bare).retrieve(masks["seat"], bare)
    assert overlap(match.indices, masks["seat"]) > 0.9


@pytest.fixture(scope="module")
def dense():
    return chair(count=40_000, draw=1)


@pytest.mark.parametrize("method", ["mask", "points"])
def test_a_dense_target_gets_results_for_all_its_points(taught, reference, dense, method):
    cloud, truth = dense
    encoded = taught.model.encode(cloud)
    assert len(encoded.working) == len(encoded.points) == WORKING_POINTS < len(cloud)
    match = taught.retrieve(reference[1]["seat"], encoded, method)
    check(match, len(cloud))
    if method == "points":
        assert truth["seat"][match.indices].mean() > 0.9
    else:
        assert overlap(match.indices, truth["seat"]) > 0.9
        unused = ~np.isin(match.indices, encoded.working)
        assert unused.mean() == pytest.approx(1 - WORKING_POINTS / len(cloud), abs=0.1)


def test_a_dense_reference_keeps_every_point_of_its_regions(model, dense):
    cloud, masks = dense
    taught = model.set_reference(cloud)
    region = np.flatnonzero(masks["seat"])[::-1]
    by_mask = taught.retrieve(region, cloud)
    assert overlap(by_mask.indices, masks["seat"]) > 0.9
    np.testing.assert_allclose(by_mask.points, cloud.points[region], atol=1e-5)
    # A region that lies wholly between the points in use is not lost.
    unused = np.setdiff1d(region, taught.encoded_cloud.working)[:40]
    assert taught._working_mask(unused).any()
    by_points = taught.retrieve(unused, cloud, "points")
    np.testing.assert_allclose(by_points.points, cloud.points[unused], atol=1e-5)


def test_the_target_is_encoded_and_mapped_once_for_all_regions(model, reference, monkeypatch):
    taught, calls = model.set_reference(reference[0]), []
    for name in ("embed", "describe", "invert"):
        own = getattr(model.field, name)
        monkeypatch.setattr(
            model.field, name, lambda *a, own=own, name=name: calls.append(name) or own(*a)
        )
    target, _ = chair(seed=5)
    taught.retrieve_all(reference[1], target)
    # Mapped forth, and some of its points back.
    assert calls == ["embed", "invert", "describe", "invert"]
    calls.clear()
    encoded = model.encode(target)
    first = taught.retrieve_all(reference[1], encoded)
    again = taught.retrieve_all(reference[1], encoded, "points")
    assert calls.count("embed") == 1 and calls.count("describe") == 2
    assert set(encoded.seconds) == {"normalise", "normals", "embed", "map", "associate"}
    assert all(first[name].points.shape == again[name].points.shape for name in first)


def test_the_same_call_gives_the_same_answer(reference):
    target, _ = chair(seed=5)
    one, two = (
        build().set_reference(reference[0]).retrieve(reference[1]["seat"], target) for _ in "ab"
    )
    np.testing.assert_array_equal(one.indices, two.indices)
    np.testing.assert_array_equal(one.points, two.points)
    np.testing.assert_array_equal(one.confidence, two.confidence)


def test_the_order_of_points_does_not_matter(reference):
    """Where the encoder sees all points, so that which ones it sees cannot depend on the order."""
    model = build(encoder_points=COUNT)
    with torch.no_grad():
        for parameter in model.field.parameters():
            parameter.add_(0.03 * torch.randn_like(parameter))
        model.field.inverse.leave.bias[7] = 1.0  # log error: it knows that it is far off
    cloud, masks = reference
    target, _ = chair(seed=5)
    first = model.set_reference(cloud).retrieve(masks["seat"], target)
    order, other = np.random.default_rng(0).permutation(COUNT), np.random.default_rng(1)
    other = other.permutation(COUNT)
    again = model.set_reference(cloud.select(order)).retrieve(
        masks["seat"][order], target.select(other)
    )
    assert len(first.indices) > 50
    assert overlap(other[again.indices], np.isin(np.arange(COUNT), first.indices)) > 0.98
    expected = np.zeros((COUNT, 3))
    expected[np.flatnonzero(masks["seat"])] = first.points
    np.testing.assert_allclose(again.points, expected[order[masks["seat"][order]]], atol=1e-3)


def test_a_field_that_doubts_lowers_the_confidence(reference):
    model = build()
    cloud, masks = reference
    sure = model.set_reference(cloud).retrieve(masks["seat"], cloud)
    with torch.no_grad():
        model.field.inverse.leave.bias[7] = 1.0  # log error
    unsure = model.set_reference(cloud).retrieve(masks["seat"], cloud)
    with torch.no_grad():
        model.field.inverse.leave.bias[6] = -13.0  # existence
    absent = model.set_reference(cloud).retrieve(masks["seat"], cloud)
    assert sure.score > 1.1 * unsure.score > 0 and absent.score < MIN_CONFIDENCE
    assert len(absent.indices) > 0  # doubtful, not emptied: what was found leads back
    # Who votes depends on the error that is expected, but not on whether the points exist.
    np.testing.assert_array_equal(unsure.indices, absent.indices)
    assert overlap(unsure.indices, np.isin(np.arange(COUNT), sure.indices)) > 0.99


def test_a_part_that_the_reference_lacks_is_in_no_region(taught, reference):
    cloud, masks = reference
    # A shelf above the seat, a fifth of the chair's height away from everything.
    seat = cloud.points[masks["seat"]]
    shelf = seat[seat[:, 1] > np.median(seat[:, 1])] * [0.3, 1.0, 0.3] + [0.0, 0.2, 0.0]
    normals = np.tile([0.0, 1.0, 0.0], (len(shelf), 1))
    target = PointCloud(
        np.concatenate([cloud.points, shelf]), np.concatenate([cloud.normals, normals])
    )
    match = taught.retrieve(masks["seat"], target)
    assert overlap(match.indices[match.indices < COUNT], masks["seat"]) > 0.9
    assert not (match.indices >= COUNT).any()
    alone = taught.retrieve(masks["seat"], cloud)
    assert match.score < 0.95 * alone.score  # much around it is not explained


def test_an_unknown_method_is_refused(taught, reference):
    with pytest.raises(RegionError, match="no method 'magic'; known: mask, points"):
        taught.retrieve(reference[1]["seat"], reference[0], "magic")


def test_a_wrong_region_is_named(taught, reference):
    good = reference[1]["seat"]
    with pytest.raises(RegionError, match="region 'rim': the region is empty"):
        taught.retrieve_all({"seat": good, "rim": []}, reference[0])


def test_what_has_no_counterpart_on_the_reference_belongs_to_no_region(taught, reference):
    cloud, _ = reference
    low, high = cloud.points.min(0), cloud.points.max(0)
    inside = np.random.default_rng(0).uniform(low, high, (2000, 3))
    away = inside[cKDTree(cloud.points).query(inside)[0] > 0.15]
    assert len(away) > 20
    normals = np.vstack([cloud.normals, np.tile([0.0, 1.0, 0.0], (len(away), 1))])
    more = PointCloud(np.vstack([cloud.points, away]), normals)
    found = taught.retrieve(np.arange(COUNT), more).indices
    assert (found < COUNT).mean() > 0.99 and len(found) > 0.95 * COUNT


def test_a_pose_takes_the_place_of_orientation_and_box(taught, reference):
    cloud, masks = reference
    turn = upright(up_axis("z")) @ rotation_about_up(2.0)
    pose = Similarity(turn, np.array([5.0, -7.0, 9.0]), 30.0)
    own = taught.encoded_cloud.pose
    scan = PointCloud(pose.to_scan(own.to_canonical(cloud.points)), cloud.normals @ turn.T)
    encoded = taught.model.encode(scan, pose)
    match = taught.retrieve(masks["seat"], encoded)
    assert overlap(match.indices, masks["seat"]) > 0.95
    np.testing.assert_allclose(match.points, scan.points[masks["seat"]], atol=0.02)
    found = EncodedReference(taught.model, encoded).retrieve(scan.points[masks["seat"]], cloud)
    assert overlap(found.indices, masks["seat"]) > 0.95
