from __future__ import annotations

from dataclasses import replace

import pytest

from builders.taught_box import METRICS, made_up
from nrdf.process.limits import Limits, strict_warnings
from nrdf.regions.presence import ABSENT, NOT_OBSERVED, Presence


@pytest.mark.parametrize(
    ("limit", "good", "bad", "message"),
    [
        ("min_coverage", 0.99, 0.999, "of the whole region is 0.995, below 0.999"),
        ("max_line_spacing_m", 0.045, 0.041, "worst line spacing is 42 mm, above 41 mm"),
        (
            "max_surface_distance_m",
            0.0013,
            0.0011,
            "from the mesh as given (12 triangles) is 1.2 mm, above 1.1 mm",
        ),
        ("max_step_m", 0.022, 0.02, "largest step between waypoints is 21 mm, above 20 mm"),
        ("max_turn_rad", 0.03, 0.01, "turn of the tool's axis between waypoints is 1.146°, above"),
        ("max_axis_error_rad", 0.02, 0.005, "(99th percentile) is 0.573°, above 0.2865°"),
        ("max_cycle_time_s", 60.0, 40.0, "the cycle time is 50.0 s, above 40 s"),
    ],
)
def test_each_limit_is_met_or_says_by_how_much_it_is_not(limit, good, bad, message):
    assert Limits(**{limit: good}).broken(made_up()) == []
    (line,) = Limits(**{limit: bad}).broken(made_up())
    assert message in line
    assert limit == "max_cycle_time_s" or line.startswith("region 'top', sand: ")


def test_the_coverage_is_of_what_was_found_not_of_what_is_left_of_it():
    left_out = {"no_clearance": 0.194, "edge_margin": 0.0}
    metrics = replace(METRICS, coverage=0.806, left_out=left_out, unreached=0.0)
    (line,) = Limits(min_coverage=0.95).broken(made_up(metrics=metrics))
    assert "is 0.806, below 0.95 (left out: 0.194, unreached: 0.000)" in line


def test_the_distance_is_that_from_the_surface_planned_on_where_no_other_is_known():
    metrics = replace(METRICS, true_distance_worst_m=None, compared_with=None)
    assert Limits(max_surface_distance_m=0.001).broken(made_up(metrics=metrics)) == []
    (line,) = Limits(max_surface_distance_m=0.0005).broken(made_up(metrics=metrics))
    assert "from the surface planned on is 0.9 mm, above 0.5 mm" in line


def test_no_limit_is_always_met():
    assert Limits().broken(made_up(metrics=replace(METRICS, coverage=0.0))) == []


def test_what_has_no_path_counts_only_where_all_are_required():
    skipped = made_up(missing="found nowhere on the target")
    assert Limits(min_coverage=1.0, max_cycle_time_s=1.0).broken(skipped) == []
    (line,) = Limits(require_all=True).broken(skipped)
    assert line == "region 'top', sand: there is no tool path: found nowhere on the target"


def test_a_single_line_has_no_spacing_to_be_too_wide():
    alone = made_up(metrics=replace(METRICS, line_spacing_worst_m=None))
    assert Limits(max_line_spacing_m=0.001).broken(alone) == []


def test_what_is_sure_is_not_doubted():
    assert strict_warnings(made_up(confidence=0.5)) == []
    assert strict_warnings(with_match(made_up(missing="absent"), presence=absent(0.95))) == []
    assert (
        strict_warnings(with_match(made_up(missing="marked as not there"), method="marked")) == []
    )


@pytest.mark.parametrize(
    ("transferred", "message"),
    [
        (made_up(confidence=0.3), "region 'top': doubtful: confidence 0.30; look at it"),
        (made_up(missing="confidence 0.10, below 0.2"), "perhaps there all the same: confidence"),
        (replace(made_up(), target_warnings=("the pose is ambiguous",)), "the pose is ambiguous"),
    ],
)
def test_what_is_doubtful_is_said(transferred, message):
    (line,) = strict_warnings(transferred)
    assert message in line


def test_a_region_that_may_be_there_is_doubtful():
    for presence in (absent(0.6), Presence(NOT_OBSERVED, 0.95, 0.0, 0.0)):
        skipped = with_match(made_up(missing="skipped"), presence=presence)
        assert strict_warnings(skipped) == ["region 'top': perhaps there all the same: skipped"]


def absent(confidence):
    return Presence(ABSENT, confidence, 1 - confidence, 0.5)


def with_match(transferred, **changes):
    found = transferred.regions["top"]
    regions = {"top": replace(found, match=replace(found.match, **changes))}
    return replace(transferred, regions=regions)
