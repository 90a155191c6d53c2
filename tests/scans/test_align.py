"""Alignment with the zoo's weights: yaw, scale and centre, left and right, and its warnings."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import nrdf
from builders.scenes import UP, pose, scan_of, triangles, yaw_error
from nrdf.errors import CloudError, ModelError
from nrdf.geometry.canonical import rotation_about_up
from nrdf.geometry.similarity import Similarity, up_axis, upright
from nrdf.geometry.units import find_unit
from nrdf.io.cloud import PointCloud
from nrdf.regions.model import Model
from nrdf.scans.align import Alignment, Candidate, align_scan
from nrdf.scans.aligned_scan import clean_and_align
from nrdf.scans.mirror import mirror_plane
from nrdf.scans.pose_scorer import PoseScorer, family_prototypes
from nrdf.shapes.families import get_family

CHAIR, ARMCHAIR = 1_000_003, 900_077
PLACE = pose(2.2, 900.0, (300, -50, 20))


@cache
def scorer(category: str) -> PoseScorer:
    return PoseScorer(nrdf.load_model(category))


@cache
def full(category: str, seed: int, count: int = 5000):
    return get_family(category).member(seed).sample_surface(count, np.random.default_rng(0))


@pytest.mark.parametrize("category", ["chair", "car", "plane"])
def test_a_full_cloud_is_found_in_any_pose(category):
    points = PLACE.to_scan(full(category, CHAIR).points)
    found = align_scan(scorer(category), PointCloud(points), UP)
    best = found.best
    assert yaw_error(best.pose, PLACE) < 2
    assert best.pose.scale == pytest.approx(PLACE.scale, rel=0.02)
    np.testing.assert_allclose(best.pose.translation, PLACE.translation, atol=0.01 * 900)
    assert np.linalg.det(best.pose.rotation) == pytest.approx(1)
    assert best.symmetry > 0.9
    assert sum(c.probability for c in found.candidates) == pytest.approx(1)
    assert [c.cost for c in found.candidates] == sorted(c.cost for c in found.candidates)
    yaw = np.degrees(best.yaw - 2.2) % 360
    assert min(yaw, 360 - yaw) < 2 and np.allclose(best.up, UP)


def test_a_partial_scan_is_found_and_its_results_come_back_in_its_own_frame():
    scan = scan_of("chair", CHAIR, PLACE, views=3, floor=True)
    found = clean_and_align(scorer("chair"), scan.cloud, UP, unit="mm")
    assert yaw_error(found.alignment.best.pose, PLACE) < 5
    assert found.alignment.best.pose.scale == pytest.approx(900, rel=0.03)
    assert found.unit.name == "mm" and found.kind.fits and found.warnings == []
    wrong = replace(found, unit=find_unit("m", 900, "chair"))
    assert ["the unit may be wrong: 900 m" in doubt for doubt in wrong.warnings] == [True]
    two = replace(found, cleaned=replace(found.cleaned, others=1))
    assert ["2 objects of comparable size" in doubt for doubt in two.warnings] == [True]
    surface = full("chair", CHAIR)
    names = get_family("chair").region_of(surface.coordinates)
    taught = found.scorer.model.set_reference(PointCloud(surface.points, surface.normals))
    match = taught.retrieve(names == "seat", found.encode()).in_scan(found)
    inside = PLACE.to_canonical(scan.cloud.points[match.indices])
    seat = surface.points[names == "seat"]
    assert len(inside) > 300
    assert (scan.face[match.indices] >= 0).all(), "nothing of the floor"
    near = np.abs(inside[:, 1] - np.median(seat[:, 1])) < 0.06
    assert near.mean() > 0.9


def test_without_sensors_a_sheet_stands_for_both_of_its_sides():
    family, surface = get_family("chair"), full("chair", CHAIR)
    names = family.region_of(surface.coordinates)
    scan = scan_of("chair", CHAIR, PLACE, views=1)
    coordinates = triangles("chair", CHAIR).at(scan.face, scan.second, scan.third)
    true = family.region_of(coordinates)
    bare = clean_and_align(scorer("chair"), replace(scan.cloud, sensors=None), UP)
    seen = clean_and_align(scorer("chair"), scan.cloud, UP).encode()
    two = bare.encode()
    assert len(two.working) > 1.5 * len(np.unique(two.working))
    assert len(seen.working) == len(np.unique(seen.working)), "sensors tell the side"
    taught = bare.scorer.model.set_reference(PointCloud(surface.points, surface.normals))
    match = taught.retrieve(names == "seat", two).in_scan(bare)
    assert (np.diff(match.indices) > 0).all() and len(match.confidence) == len(match.indices)
    assert (true == "seat")[match.indices].mean() > 0.9
    assert len(match.indices) > 0.9 * (true == "seat").sum()
    snapped = taught.retrieve(names == "seat", two, "points").indices
    assert (np.diff(snapped) > 0).all() and (true == "seat")[snapped].mean() > 0.8
    on_seat = np.isin(bare.cleaned.kept, np.flatnonzero(true == "seat"))
    for side, sign in (("seat", 1), ("seat-bottom", -1)):
        turned = taught.orient_sheets({side: names == side}, bare.encode_in_metres("m"))
        up = sign * turned.normals[on_seat[turned.working], 1]
        assert (up > 0).mean() > 0.9, "the side that was asked for"


def test_up_is_searched_where_it_is_not_known():
    turned = Similarity(upright(up_axis("-y")) @ rotation_about_up(1.0), np.zeros(3), 5.0)
    points = turned.to_scan(full("chair", CHAIR).points)
    found = clean_and_align(scorer("chair"), PointCloud(points))
    np.testing.assert_allclose(found.alignment.best.up, up_axis("-y"))
    assert yaw_error(found.alignment.best.pose, turned) < 5


def test_left_stays_left():
    surface = full("chair", ARMCHAIR, 8192)
    names = get_family("chair").region_of(surface.coordinates)
    left = names == "leg-left-front"
    scan = PointCloud(PLACE.to_scan(surface.points))
    found = clean_and_align(scorer("chair"), scan, UP)
    taught = found.scorer.model.set_reference(PointCloud(surface.points, surface.normals))
    match = taught.retrieve(left, found.encode()).in_scan(found)
    assert left[match.indices].mean() > 0.9 and len(match.indices) > 0.7 * left.sum()


def test_a_stool_that_looks_alike_from_all_sides_is_ambiguous():
    rng = np.random.default_rng(0)
    top = rng.uniform([-0.3, 0.0, -0.3], [0.3, 0.04, 0.3], (2500, 3))
    side = rng.integers(0, 3, len(top))
    rows = np.arange(len(top))
    bound = np.array([[-0.3, 0.0, -0.3], [0.3, 0.04, 0.3]])
    top[rows, side] = bound[rng.integers(0, 2, len(top)), side]
    angle = rng.uniform(0, 2 * np.pi, 2000)
    legs = np.stack([0.02 * np.cos(angle), rng.uniform(-0.5, 0, 2000), 0.02 * np.sin(angle)], 1)
    legs[:, [0, 2]] += 0.26 * rng.choice([-1, 1], (2000, 2))
    found = clean_and_align(scorer("chair"), PointCloud(np.vstack([top, legs])), up_axis("y"))
    assert found.alignment.is_ambiguous and len(found.alignment.likely) >= 2
    assert any("the pose is ambiguous: yaws of" in doubt for doubt in found.warnings)


def test_a_car_is_no_chair():
    car = PointCloud(full("car", CHAIR).points)
    found = clean_and_align(scorer("chair"), car, up_axis("y"))
    assert not found.kind.fits
    assert any("does not look like a chair" in doubt for doubt in found.warnings)
    assert clean_and_align(scorer("car"), car, up_axis("y")).kind.fits
    chair = PointCloud(full("chair", CHAIR).points)
    assert not clean_and_align(scorer("car"), chair, up_axis("y")).kind.fits


class Facing:
    """Says that everything is turned by one yaw (rad), this sure of it."""

    def __init__(self, yaw: float, sure: float) -> None:
        self.told = sure * np.cos(2 * np.pi / 36 * np.arange(36) - yaw)

    def log_probability(self, points, normals):
        assert points.shape == normals.shape and len(points) > 512
        return self.told


@pytest.mark.parametrize(("way", "sure", "turned"), [(2.2, 3, 0), (2.2 + np.pi, 60, 180)])
def test_what_faces_the_other_way_is_told_by_field_and_network_together(way, sure, turned):
    points = PLACE.to_scan(full("car", CHAIR).points)
    asked = PoseScorer(scorer("car").model, yaw=Facing(way, sure))
    found = align_scan(asked, PointCloud(points), UP)
    assert yaw_error(found.best.pose, PLACE) == pytest.approx(turned, abs=2)
    other = next(c for c in found.candidates if yaw_error(c.pose, found.best.pose) > 170)
    assert other.probability < 0.3 and other.cost > other.field_cost
    assert found.best.cost == pytest.approx(found.best.field_cost, abs=0.01)


def test_likely_poses_are_those_that_no_other_one_beats_clearly():
    poses = [
        Candidate(pose(0.1 * i), UP, 0.1 * i, 0.0, 1.0, p) for i, p in enumerate((0.5, 0.4, 0.1))
    ]
    assert Alignment(tuple(poses)).is_ambiguous
    assert Alignment(tuple(poses)).likely == tuple(poses[:2])
    assert not Alignment((poses[0], poses[2])).is_ambiguous


def test_an_unusable_scan_is_refused():
    with pytest.raises(CloudError, match="has 10 points; at least 256"):
        align_scan(scorer("chair"), PointCloud(np.random.default_rng(0).random((10, 3))), UP)


def test_a_category_without_a_family_needs_an_example():
    with pytest.raises(ModelError, match=r"'teapot' has no parametric family.*give a --reference"):
        family_prototypes("teapot")
    model = scorer("chair").model
    other = Model(model.field, {"category": "teapot"})
    example = full("chair", 1_000_009)
    found = align_scan(
        PoseScorer(other, [PointCloud(example.points, example.normals)]),
        PointCloud(PLACE.to_scan(full("chair", CHAIR).points)),
        UP,
    )
    assert yaw_error(found.best.pose, PLACE) < 5


@pytest.mark.parametrize("start", [-9.0, 0.0, 9.0])
def test_the_mirror_plane_is_found_from_near_it(start):
    surface = full("chair", CHAIR)
    turn, away = rotation_about_up(0.4), np.array([0.2, 0.0, -0.3])
    plane = mirror_plane(
        surface.points @ turn.T + away,
        surface.normals @ turn.T,
        rotation_about_up(0.4 + np.radians(start))[:, 2],
    )
    assert np.degrees(np.arccos(plane.normal @ turn[:, 2])) < 0.5
    assert plane.offset == pytest.approx(away @ turn[:, 2], abs=0.005)
    assert plane.agreement > 0.9


def test_across_no_mirror_plane_little_agrees():
    surface = full("car", CHAIR)
    plane = mirror_plane(surface.points, surface.normals, rotation_about_up(np.radians(45))[:, 2])
    assert plane.agreement < 0.4
