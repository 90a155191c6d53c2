"""Quantities in files: units, bounds, plain values and the JSON schema."""

from __future__ import annotations

import math

import pytest

from builders.knowledge import SAND, content, parsed
from nrdf.errors import ProcessError
from nrdf.process.knowledge import Knowledge
from nrdf.process.knowledge_file import KNOWLEDGE_FILE


def test_people_may_use_millimetres_degrees_and_rpm():
    given = {**SAND, "lead_deg": 3, "spindle_rpm": 6000, "approach": {"distance_mm": 40}}
    process = parsed(process=given).regions[0].processes[0]
    assert process.stepover_m == 0.015 and process.tool.radius_m == 0.025
    assert process.feed_m_s == 0.1 and process.approach.distance_m == 0.04
    assert process.lead_rad == pytest.approx(math.radians(3))
    assert process.spindle_rad_s == pytest.approx(200 * math.pi)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"x": math.nan}, "numbers must be finite, not nan"),
        ({"x": [{"y": math.inf}]}, "numbers must be finite, not inf"),
        ({"x": "\ud800"}, "surrogate"),
        ({"x": {1, 2}}, "not set"),
        ({"x": b"1"}, "not bytes"),
    ],
)
def test_parameters_are_what_every_file_can_hold(parameters, message):
    with pytest.raises(ProcessError, match=message):
        KNOWLEDGE_FILE.validated(content(process={**SAND, "parameters": parameters}), "k")


@pytest.mark.parametrize("name", ["", "a\0b", "\ud800", "a" * 5000])
def test_names_that_no_file_can_have_are_refused(name):
    for changes in ({"reference": {"cloud": name}}, {"region": {"file": name}}):
        with pytest.raises(ProcessError, match=r"reference\.cloud|region 'seat', file"):
            parsed(**changes)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"region": {"indices": [10**30]}}, "indices.0: must be"),
        ({"reference": {"points_m": [[1e300, 0, 0]]}}, "points_m.0.0: must be at most 1000000"),
        ({"regions": [{"name": f"r{k}", "indices": [1], "processes": [SAND]} for k in range(501)]},
         "at most 500 items"),
        ({"region": {"mask": ["x"] * 100_000}}, "region 'seat', mask.0: "),
    ],
)  # fmt: skip
def test_numbers_and_lists_are_bounded(changes, message):
    with pytest.raises(ProcessError, match=message) as caught:
        parsed(**changes)
    assert len(str(caught.value)) < 1000


def test_the_json_schema_knows_the_other_units():
    schema = Knowledge.model_json_schema()
    process = schema["$defs"]["Process"]
    assert process["additionalProperties"] is False
    assert {"stepover_m", "stepover_mm", "feed_mm_s", "spindle_rpm"} <= set(process["properties"])
    assert process["properties"]["lead_deg"]["exclusiveMaximum"] == pytest.approx(90)
    assert "feed_m_s" not in process["required"] and "kind" in process["required"]
    assert {"oneOf": [{"required": ["feed_m_s"]}, {"required": ["feed_mm_s"]}]} in process["allOf"]
    assert all(field.get("description") for field in process["properties"].values())
    for given, is_good in ((SAND, True), ({**SAND, "feed_m_s": 1}, False)):
        either = process["allOf"][0]["oneOf"]
        assert (sum(set(one["required"]) <= set(given) for one in either) == 1) is is_good
