import pytest

from nrdf.scans.units import find_unit


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
    assert (found.name, found.origin, found.doubt) == (unit, "guessed", "")


def test_no_unit_fits_or_nothing_is_known_of_the_category():
    found = find_unit(None, 1e-6, "chair")
    assert found.name is None and "in none is it 0.45 to 1.6 m long, as a chair" in found.doubt
    assert find_unit(None, 1.0, "teapot").origin == "unknown"


def test_a_given_unit_is_kept_but_doubted_where_it_is_far_off():
    assert find_unit("mm", 900, "chair").doubt == ""
    wrong = find_unit("m", 900, "chair")
    assert wrong.name == "m" and "900 m is not the 0.45 to 1.6 m of a usual chair" in wrong.doubt
    assert "in mm it would be" in wrong.doubt
    toy = find_unit("mm", 300, "chair")
    assert toy.doubt == ""
