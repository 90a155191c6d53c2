"""Process knowledge: what it may say, and what is refused with which words."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from builders.knowledge import SAND, content, parsed
from nrdf.errors import ProcessError
from nrdf.geometry.units import METRES
from nrdf.process.knowledge import Reference, Region


def test_several_processes_keep_their_order():
    region = content()["regions"][0]
    region["processes"] = [SAND, {**SAND, "kind": "oil"}, {**SAND, "name": "sand, fine"}]
    found = parsed(regions=[region]).regions[0].processes
    assert [process.label for process in found] == ["sand", "oil", "sand, fine"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"version": 2}, "k.yaml has version 2, from a newer nrdf; this one reads version 1"),
        ({"version": 0}, "k.yaml has version 0, which never was a version of this format; change"),
        ({"version": "one"}, "version: "),
        ({"regions": []}, "regions: "),
        ({"regoins": []}, "unknown key 'regoins'; did you mean 'regions'?"),
        ({"reference": {}}, "give either cloud (a file) or points_m"),
        ({"reference": {"cloud": "a", "points_m": [[0, 0, 0]]}}, "give either cloud"),
        ({"reference": {"cloud": "a", "unit": "furlong"}}, "'mm' or 'in', not 'furlong'"),
        ({"reference": {"cloud": "a", "sha256": "123"}}, "reference.sha256: "),
        ({"reference": {"points_m": [[0, 0, 0]], "unit": "mm"}}, "points_m is in metres"),
        ({"reference": {"points_m": [[0, 0, 0]], "normals": []}}, "normals need points_m, one"),
        ({"region": {}}, "region 'seat': give exactly one of file, mask, indices, points_m; given: "
         "none"),
        ({"region": {"file": "a", "mask": [True]}}, "given: file, mask"),
        ({"region": {"indices": [-1]}}, "region 'seat', indices.0: must be at least 0, not -1"),
        ({"region": {"name": "../seat", "indices": [1]}}, "becomes a file name"),
        ({"category": ""}, "category: "),
    ],
)  # fmt: skip
def test_a_file_that_makes_no_sense_is_explained(change, message):
    with pytest.raises(ProcessError) as caught:
        parsed(**change)
    assert message in str(caught.value)


def test_two_regions_of_one_name_are_refused():
    with pytest.raises(ProcessError, match="two regions are called 'seat'; rename one"):
        parsed(regions=content()["regions"] * 2)


def test_units_are_those_of_clouds():
    with pytest.raises(ValidationError):
        Reference.model_validate({"cloud": "a", "unit": "km"})
    for unit in METRES:
        assert Reference.model_validate({"cloud": "a", "unit": unit}).unit == unit


def test_processes_of_one_label_are_told_apart():
    sand = {"kind": "sand", "stepover_mm": 20, "tool": {"radius_mm": 25}, "feed_mm_s": 100}
    named = {**sand, "name": "sand 2"}
    oil = {**sand, "kind": "oil"}
    region = Region.model_validate(
        {"name": "seat", "indices": [0], "processes": [sand, oil, sand, named, sand]}
    )
    assert [p.label for p in region.steps] == ["sand", "oil", "sand 3", "sand 2", "sand 4"]
    assert [p.label for p in region.processes] == ["sand", "oil", "sand", "sand 2", "sand"]
    long = {**sand, "name": "x" * 200}
    region = Region.model_validate({"name": "seat", "indices": [0], "processes": [long, long]})
    assert region.steps[1].name == "x" * 190 + " 2"
