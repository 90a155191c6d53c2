from __future__ import annotations

import math

import pytest

from nrdf.geometry.units import METRES, accepted_names, find_unit, guess_unit, readable, to_si


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("stepover_m", 0.015, "15 mm"),
        ("tilt_rad", math.radians(10), "10°"),
        ("feed_m_s", 0.1, "100 mm/s"),
        ("spindle_rad_s", 100 * math.pi, "3000 rpm"),
        ("force_n", 12.5, "12.5 N"),
        ("dwell_s", 0.5, "0.5 s"),
        ("overlap", 0.3, "0.3"),
    ],
)
def test_quantities_are_shown_as_people_read_them(name, value, words):
    assert readable(name, value) == words


@pytest.mark.parametrize(
    ("other", "value", "name", "si"),
    [
        ("stepover_mm", 15, "stepover_m", 0.015),
        ("turn_deg_mm", 180, "turn_rad_m", 1e3 * math.pi),
        ("tilt_deg", 180, "tilt_rad", math.pi),
        ("feed_mm_s", 100, "feed_m_s", 0.1),
        ("spindle_rpm", 60, "spindle_rad_s", 2 * math.pi),
        ("points_mm", [[1, 2], [3, "x"]], "points_m", [[0.001, 0.002], [0.003, "x"]]),
    ],
)
def test_a_file_may_use_other_units(other, value, name, si):
    assert list(accepted_names(name)) == [other]
    found = to_si({other: value, "rest": 1}, [name])
    assert found.pop("rest") == 1
    assert found[name] == (pytest.approx(si, rel=1e-14) if isinstance(si, float) else si)


def test_what_has_no_other_unit_stays():
    assert to_si({"dwell_s": 1, "force_n": 2}, ["dwell_s", "force_n"]) == {
        "dwell_s": 1,
        "force_n": 2,
    }
    assert to_si({"feed_mm_s": True}, ["feed_m_s"]) == {"feed_m_s": True}


def test_a_quantity_given_twice_is_refused():
    with pytest.raises(ValueError, match="give stepover_m or stepover_mm, not both"):
        to_si({"stepover_m": 0.01, "stepover_mm": 10}, ["stepover_m"])


@pytest.mark.parametrize(
    ("size", "category", "unit"),
    [
        (0.9, "chair", "m"),
        (90, "chair", "cm"),
        (900, "chair", "mm"),
        (36, "chair", "in"),
        (50, "chair", None),  # 0.5 m in cm, 1.27 m in inches
        (4500, "car", "mm"),
        (1.0, "car", None),  # canonical
        (0.9, "lamp", None),
    ],
)
def test_a_unit_is_guessed_only_where_it_is_the_only_plausible_one(size, category, unit):
    assert guess_unit(size, category) == unit
    assert unit is None or unit in METRES


@pytest.mark.parametrize(
    ("size", "category", "unit"),
    [
        (0.9, "chair", "m"),
        (900, "chair", "mm"),
        (90, "chair", "cm"),
        (4.5, "car", "m"),
        (4500, "car", "mm"),
        (35, "plane", "m"),
    ],
)
def test_a_unit_is_guessed_from_the_usual_size(size, category, unit):
    found = find_unit(None, size, category)
    assert (found.name, found.origin, found.warning) == (unit, "guessed", "")


def test_no_unit_fits_or_nothing_is_known_of_the_category():
    found = find_unit(None, 1e-6, "chair")
    assert found.name is None and "in no unit is it 0.4 to 1.6 m" in found.warning
    assert find_unit(None, 1.0, "teapot").origin == "unknown"


def test_a_given_unit_is_kept_but_doubted_where_it_is_far_off():
    assert find_unit("mm", 900, "chair").warning == ""
    wrong = find_unit("m", 900, "chair")
    assert wrong.name == "m" and "900 m is not the 0.4 to 1.6 m of a usual chair" in wrong.warning
    assert "in mm it would be" in wrong.warning
    toy = find_unit("mm", 300, "chair")
    assert toy.warning == ""


def test_a_guess_between_several_units_is_doubted():
    found = find_unit(None, 50, "chair")
    assert (found.name, found.origin) == ("cm", "guessed")
    assert found.warning == "a usual chair may be this long in cm or in"
