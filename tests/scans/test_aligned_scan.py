"""A scan cleaned, aligned and encoded: results in its own frame, and its warnings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from builders.scenes import UP, full, pose, scan_of, scorer, triangles, yaw_error
from nrdf.geometry.canonical import rotation_about_up
from nrdf.geometry.similarity import Similarity, up_axis, upright
from nrdf.geometry.units import find_unit
from nrdf.io.cloud import PointCloud
from nrdf.scans.aligned_scan import clean_and_align
from nrdf.shapes.families import get_family

CHAIR, ARMCHAIR = 1_000_003, 900_077
PLACE = pose(2.2, 900.0, (300, -50, 20))


def test_a_partial_scan_is_found_and_its_results_come_back_in_its_own_frame():
    scan = scan_of("chair", CHAIR, PLACE, views=3, floor=True)
    found = clean_and_align(scorer("chair"), scan.cloud, UP, unit="mm")
    assert yaw_error(found.alignment.best.pose, PLACE) < 5
    assert found.alignment.best.pose.scale == pytest.approx(900, rel=0.03)
    assert found.unit.name == "mm" and found.kind.fits and found.warnings == []
    wrong = replace(found, unit=find_unit("m", 900, "chair"))
    assert ["the unit may be wrong: 900 m" in warning for warning in wrong.warnings] == [True]
    two = replace(found, cleaned=replace(found.cleaned, others=1))
    assert ["2 objects of comparable size" in warning for warning in two.warnings] == [True]
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
    assert any("the pose is ambiguous: yaws of" in warning for warning in found.warnings)


def test_a_car_is_no_chair():
    car = PointCloud(full("car", CHAIR).points)
    found = clean_and_align(scorer("chair"), car, up_axis("y"))
    assert not found.kind.fits
    assert any("does not look like a chair" in warning for warning in found.warnings)
    assert clean_and_align(scorer("car"), car, up_axis("y")).kind.fits
    chair = PointCloud(full("chair", CHAIR).points)
    assert not clean_and_align(scorer("car"), chair, up_axis("y")).kind.fits
