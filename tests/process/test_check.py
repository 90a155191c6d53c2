from __future__ import annotations

import numpy as np
import pytest

from builders.taught_box import SAND, bound_knowledge, cloud, solid
from nrdf.io.cloud import PointCloud
from nrdf.process.check import check_knowledge


def checked(reference=None, name="top", **changes):
    (row,) = check_knowledge(bound_knowledge({name: [{**SAND, **changes}]}, reference))
    return row


def test_a_good_process_is_planned_and_measured():
    row = checked()
    assert (row.region, row.fault, row.where) == ("top", "", "region 'top', sand")
    assert row.metrics.coverage > 0.95


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"edge_margin_mm": 400}, "edge_margin_m is 0.4, which leaves nothing of the region"),
        ({"stepover_mm": 950}, "stepover_m is 0.95, wider than the region, which measures 0."),
        ({"spacing_mm": 950}, "spacing_m is 0.95 (950 mm), longer than the region, 9"),
        ({"direction": [0, 1, 0]}, "stands on the region instead of running along it"),
        (
            {"trajectory": "taught", "waypoints": [{"positions_m": [[0, 0.3, 0], [0, 0.7, 0]]}]},
            "number 2 of line 1 is 400 mm",
        ),
    ],
)
def test_what_cannot_be_done_is_said_by_field_and_value(change, message):
    row = checked(**change)
    assert message in row.fault and row.metrics is None


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"stepover_mm": 60}, "stepover_m is 0.06 (60 mm), more than the tool's width of 50 mm"),
        ({"force_n": None}, "sand without force_n: the robot holds a position"),
    ],
)
def test_what_can_be_done_but_should_be_looked_at_has_a_warning(change, message):
    given = {key: value for key, value in {**SAND, **change}.items() if value is not None}
    (row,) = check_knowledge(bound_knowledge({"top": [given]}))
    assert any(message in line for line in row.warnings) and row.fault == ""


def test_a_spacing_longer_than_the_region_may_be_meant():
    row = checked(spacing_mm=950, allow_unusual=True)
    assert row.fault == "" and row.metrics.coverage > 0.9


def test_taught_lines_are_measured_as_they_are():
    along = np.linspace(-0.3, 0.3, 20)
    lines = [{"positions_m": [[x, 0.3, z] for z in along.tolist()]} for x in (-0.1, 0.0, 0.1)]
    row = checked(trajectory="taught", waypoints=lines)
    assert row.fault == ""
    assert row.metrics.coverage == pytest.approx(3 * 0.6 * 0.05 / (0.5 * 0.9), abs=0.06)
    assert row.metrics.process_length_m == pytest.approx(1.8, rel=0.02)


def test_a_reference_without_normals_will_do_and_progress_is_told():
    told = []
    bare = PointCloud(cloud().points, unit="m")
    taught = bound_knowledge({"top": [SAND, SAND]})
    rows = check_knowledge(
        type(taught)(taught.knowledge, bare, taught.regions), lambda *now: told.append(now)
    )
    assert [row.fault for row in rows] == ["", ""] and told == [(1, 2), (2, 2)]


@pytest.mark.parametrize("trajectory", ["spiral", "contour"])
def test_spirals_and_contours_have_no_wide_gaps_in_corners(trajectory):
    row = checked(solid(), trajectory=trajectory)
    stepover = row.process.distance_between_lines_m
    assert row.metrics.line_spacing_worst_m < 1.15 * stepover


@pytest.mark.parametrize("trajectory", ["raster", "cross-hatch", "spiral", "contour"])
def test_a_plate_is_covered_whole(trajectory):
    row = checked(solid(), trajectory=trajectory)
    assert row.metrics.coverage > 0.999 and row.metrics.true_distance_worst_m < 1e-6
