"""Process knowledge: what it may say, and what is refused with which words."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import get_args

import pytest
from pydantic import ValidationError

from nrdf.errors import ProcessError
from nrdf.geometry.units import METRES
from nrdf.process import knowledge_file
from nrdf.process.knowledge import Knowledge, Process, Reference, Region, Trajectory
from nrdf.process.knowledge_file import (
    parse_knowledge,
    read_knowledge,
    validated,
    write_knowledge,
)
from nrdf.toolpath.strategy import TRAJECTORIES

SAND = {"kind": "sand", "stepover_mm": 15, "tool": {"radius_mm": 25}, "feed_mm_s": 100}
TAUGHT = {**SAND, "trajectory": "taught", "waypoints": [{"positions_m": [[0, 0, 0], [1, 0, 0]]}]}

BOMB = "a: &a [1, 1, 1, 1, 1, 1, 1, 1, 1]\n" + "".join(
    f"{name}: &{name} [{', '.join(['*' + before] * 9)}]\n"
    for before, name in zip("abcdefgh", "bcdefghi", strict=True)
)


def content(process=SAND, region=(("indices", [1, 2]),), **changes):
    """A small file's content, its first process or region changed."""
    return {
        "version": 1,
        "category": "chair",
        "reference": {"cloud": "ref.ply"},
        "regions": [{"name": "seat", **dict(region), "processes": [process]}],
        **changes,
    }


def parsed(**changes):
    return parse_knowledge(json.dumps(content(**changes)), "k.yaml", as_json=True)


def test_people_may_use_millimetres_degrees_and_rpm():
    given = {**SAND, "lead_deg": 3, "spindle_rpm": 6000, "approach": {"distance_mm": 40}}
    process = parsed(process=given).regions[0].processes[0]
    assert process.stepover_m == 0.015 and process.tool.radius_m == 0.025
    assert process.feed_m_s == 0.1 and process.approach.distance_m == 0.04
    assert process.lead_rad == pytest.approx(math.radians(3))
    assert process.spindle_rad_s == pytest.approx(200 * math.pi)


def test_several_processes_keep_their_order():
    region = content()["regions"][0]
    region["processes"] = [SAND, {**SAND, "kind": "oil"}, {**SAND, "name": "sand, fine"}]
    found = parsed(regions=[region]).regions[0].processes
    assert [process.label for process in found] == ["sand", "oil", "sand, fine"]


def test_taught_segments_are_warped_and_strategies_planned_anew_unless_asked_otherwise():
    assert Process.model_validate(TAUGHT).transfer_mode == "warp"
    assert Process.model_validate(SAND).transfer_mode == "replan"
    assert Process.model_validate({**SAND, "transfer": "warp"}).transfer_mode == "warp"


def test_the_overlap_gives_the_stepover():
    given = {key: value for key, value in SAND.items() if key != "stepover_mm"}
    process = Process.model_validate({**given, "overlap": 0.2})
    assert process.distance_between_lines_m == pytest.approx(0.04)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"feed_mm_s": 0}, "region 'seat', process 1 (sand), feed_m_s: must be above 0.0, not 0.0"),
        ({"feed_mm_s": -3}, "feed_m_s: must be above 0.0, not -0.003"),
        ({"feed_mm_s": True}, "feed_m_s: must be a number, not True"),
        ({"feed_m_s": 1}, "give feed_m_s or feed_mm_s, not both"),
        ({"stepover_mm": None}, "a raster needs stepover_m or overlap"),
        ({"overlap": 0.2}, "give stepover_m or overlap, not both"),
        ({"overlap": 1, "stepover_mm": None}, "overlap: must be below 1.0, not 1"),
        ({"steppover_mm": 3}, "unknown key 'region 'seat', process 1 (sand), steppover_mm'; did "
         "you mean 'stepover_mm'?"),
        ({"trajectory": "zigzag"}, "trajectory: must be 'raster', 'cross-hatch', 'spiral', "
         "'contour' or 'taught', not 'zigzag'"),
        ({"direction": [0, 0, 0]}, "direction: a direction needs a length above 0"),
        ({"lead_deg": 90}, "lead_rad: must be below 1.57"),
        ({"passes": 0}, "passes: must be at least 1, not 0"),
        ({"kind": "custom"}, "kind is custom: give a name that says what is done"),
        ({"force_n": 0}, "force_n: must be above 0.0, not 0"),
        ({"force_n": 9, "standoff_mm": 2}, "a force without contact: force_n is 9, but standoff_m "
         "is 0.002"),
        ({"kind": "paint", "force_n": 9}, "a force without contact: force_n is 9, but kind paint"),
        ({"kind": "inspect", "force_n": 9}, "a force without contact"),
        ({"force_tolerance_n": 9}, "force_tolerance_n needs force_n"),
        ({"force_n": 9, "force_tolerance_n": 9}, "it must be below force_n, 9"),
        ({"trajectory": "taught"}, "trajectory is taught: give its waypoints"),
        ({**TAUGHT, "waypoints": []}, "trajectory is taught: give its waypoints"),
        ({**TAUGHT, "transfer": "replan"}, "use transfer: warp"),
        ({"waypoints": TAUGHT["waypoints"]}, "waypoints need trajectory: taught, not raster"),
        ({**TAUGHT, "waypoints": [{"positions_m": [[0, 0]]}]}, "line 1, positions_m"),
        ({**TAUGHT, "waypoints": [{"positions_m": [[0, 0, 0]], "quaternions_xyzw": []}]},
         "line 1: 0 quaternions_xyzw do not fit 1 positions_m"),
        ({**TAUGHT, "waypoints": [{"positions_m": [[0, 0, 0]],
          "quaternions_xyzw": [[0, 0, 0, 2]]}]}, "a quaternion needs length 1, not 2"),
        ({"tool": {"radius_mm": 0}}, "tool.radius_m: must be above 0.0, not 0.0"),
        ({"tool": {"radius_mm": 1, "nmae": "x"}}, "tool.nmae'; did you mean 'name'?"),
        ({"tool": {"radius_mm": 1, "name": "a\nb"}}, "a name needs printable characters"),
        ({"approach": {"angle_deg": 100}}, "approach.angle_rad: must be at most 1.57"),
        ({"parameters": [1]}, "parameters: must be a mapping"),
    ],
)  # fmt: skip
def test_a_process_that_makes_no_sense_is_explained_by_field_and_value(change, message):
    given = {key: value for key, value in {**SAND, **change}.items() if value is not None}
    with pytest.raises(ProcessError) as caught:
        parsed(process=given)
    assert message in str(caught.value)


IMPLAUSIBLE = [
    ({"feed_mm_s": 120_000}, "feed_m_s is 120 (120000 mm/s), above what is plausible, 5 (5000"),
    ({"feed_mm_s": 0.01}, "feed_m_s is 1e-05 (0.01 mm/s), below what is plausible, 0.0001"),
    ({"force_n": 20_000}, "force_n is 20000 (20000 N), above what is plausible, 500 (500 N)"),
    ({"dwell_s": 1e9}, "dwell_s is 1e+09 (1000000000 s), above what is plausible, 3600 (3600 s)"),
    ({"approach": {"distance_m": 1000}}, "approach.distance_m is 1000 (1000000 mm), above"),
    ({"retract": {"feed_m_s": 9}}, "retract.feed_m_s is 9 (9000 mm/s), above"),
    ({"standoff_m": 2}, "standoff_m is 2 (2000 mm), above what is plausible, 1 (1000 mm)"),
    ({"stepover_mm": 1e-3}, "stepover_m is 1e-06 (0.001 mm), below what is plausible, 0.0001"),
    ({"stepover_mm": None, "overlap": 0.999999},
     "with overlap 0.999999, stepover_m is 5e-08 (5e-05 mm), below what is plausible"),
    ({"spacing_m": 2}, "spacing_m is 2 (2000 mm), above"),
    ({"edge_margin_m": 3}, "edge_margin_m is 3 (3000 mm), above"),
    ({"tool": {"radius_m": 1e-9}}, "tool.radius_m is 1e-09 (1e-06 mm), below"),
    ({"tool": {"radius_m": 25}}, "tool.radius_m is 25 (25000 mm), above"),
    ({"tool": {"radius_m": 0.02, "clearance_m": 20}}, "tool.clearance_m is 20 (20000 mm), above"),
    ({"tool": {"radius_m": 0.02, "tcp_m": [0, 0, -80]}}, "tool.tcp_m is -80 (-80000 mm), below"),
    ({"passes": 500}, "passes is 500 (500), above what is plausible, 100"),
    ({"lead_deg": 80}, "lead_rad is 1.39626 (80°), above what is plausible, 1.0472 (60°)"),
    ({"spindle_rpm": 1e6}, "spindle_rad_s is 104720 (1000000 rpm), above"),
]  # fmt: skip


@pytest.mark.parametrize(("change", "message"), IMPLAUSIBLE)
def test_what_no_process_has_is_refused_with_its_unit_unless_it_is_meant(change, message):
    given = {key: value for key, value in {**SAND, **change}.items() if value is not None}
    with pytest.raises(ProcessError, match="set allow_unusual: true in the process") as caught:
        parsed(process=given)
    assert message in str(caught.value)
    assert parsed(process={**given, "allow_unusual": True})


def test_all_that_is_implausible_is_said_at_once():
    given = {"kind": "sand", "tool": {"radius_mm": 25}, "feed_m_s": 120, "force_n": 900}
    with pytest.raises(ProcessError, match=r"force_n is 900 .*feed_m_s is 120 .*overlap") as caught:
        parsed(process={**given, "overlap": 0.9999})
    assert str(caught.value).count("allow_unusual") == 1


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
        validated(content(process={**SAND, "parameters": parameters}), "k")


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


def test_thousands_of_faults_make_a_short_message():
    with pytest.raises(ProcessError) as caught:
        parsed(**{f"k{number}" + "x" * 1000: 1 for number in range(5000)})
    said = str(caught.value).splitlines()
    assert said[0] == "k.yaml: 5000 faults:" and said[-1].strip() == "and 4988 more"
    assert len(said) == 14 and max(map(len, said)) < 500


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"version": 2}, "k.yaml has version 2, from a newer nrdf; this one reads version 1"),
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


def test_every_fault_is_listed_at_once():
    given = {**SAND, "feed_mm_s": 0, "passes": 0}
    with pytest.raises(ProcessError) as caught:
        parsed(process=given, catgory="x")
    said = str(caught.value)
    assert said.startswith("k.yaml: 3 faults:\n") and len(said.splitlines()) == 4


def test_numbers_with_exponents_and_anchors_are_read_as_meant():
    text = """
        category: chair
        reference: {cloud: ref.ply}
        regions:
          - name: seat
            indices: [0]
            processes:
              - &sand {kind: sand, stepover_m: 15e-3, tool: {radius_m: .25e-1}, feed_m_s: 1e-1}
              - {<<: *sand, kind: oil}
    """
    sand, oil = parse_knowledge(text, "k").regions[0].processes
    assert (sand.stepover_m, sand.tool.radius_m, sand.feed_m_s) == (0.015, 0.025, 0.1)
    assert oil.kind == "oil" and oil.stepover_m == 0.015


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: [", "is not valid YAML"),
        ("3", "must hold a mapping"),
        ("category: a\ncategory: b", "the key 'category' occurs twice, again in line 2"),
        ("category: &a [*a]", "within its own anchor"),
        (BOMB, "aliases included"),
        ("a: !!python/object/apply:os.getcwd []", "is not valid YAML"),
    ],
)  # fmt: skip
def test_yaml_that_is_broken_or_hostile_is_refused(text, message):
    with pytest.raises(ProcessError) as caught:
        parse_knowledge(text, "k.yaml")
    assert message in str(caught.value)


def test_a_missing_file_and_one_that_is_no_text(tmp_path):
    with pytest.raises(ProcessError, match="nrdf teach"):
        read_knowledge(tmp_path / "none.yaml")
    (tmp_path / "binary.yaml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ProcessError, match="no text in UTF-8"):
        read_knowledge(tmp_path / "binary.yaml")
    (tmp_path / "cut.json").write_text('{"version": 1, ')
    with pytest.raises(ProcessError, match="not valid JSON"):
        read_knowledge(tmp_path / "cut.json")


def test_a_large_file_is_refused_before_it_is_read(tmp_path, monkeypatch):
    monkeypatch.setattr(knowledge_file, "_LARGEST_FILE", 10)
    (tmp_path / "k.yaml").write_text("category: chair")
    with pytest.raises(ProcessError, match="has more than"):
        read_knowledge(tmp_path / "k.yaml")


@pytest.mark.parametrize("ending", ["yaml", "json"])
@pytest.mark.parametrize("explained", [False, True])
def test_what_is_written_is_read_again(tmp_path, ending, explained):
    oil = {
        **SAND,
        "kind": "oil",
        "parameters": {"oil": "linseed: raw", "coats": [1, 2], "on": True},
    }
    custom = {**TAUGHT, "kind": "custom", "name": "no: yes", "direction": [0.1, 0, 1e-7]}
    region = content()["regions"][0]
    second = {"name": "back", "mask": [True, False], "processes": [custom]}
    third = {"name": "legs", "points_m": [[0.25, 1, 0]], "processes": [SAND]}
    regions = [{**region, "processes": [SAND, oil]}, second, third]
    given = parsed(regions=regions, allow_overlap=True)
    path = tmp_path / f"k.{ending}"
    write_knowledge(path, given, explained)
    assert read_knowledge(path) == given
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


def test_yaml_says_quantities_as_people_read_them_and_explains_each_field_once(tmp_path):
    given = parsed(process={**SAND, "tilt_deg": 10})
    write_knowledge(tmp_path / "k.yaml", given)
    text = (tmp_path / "k.yaml").read_text()
    assert "stepover_m: 0.015  # 15 mm\n" in text and "# 10°" in text
    assert "passes" not in text
    region = content()["regions"][0]
    given = parsed(regions=[{**region, "processes": [SAND, SAND]}])
    write_knowledge(tmp_path / "k.yaml", given, explained=True)
    text = (tmp_path / "k.yaml").read_text()
    assert text.count("Distance between neighbouring lines") == 1
    assert "# force_n:" in text and text.count("passes: 1") == 1
    assert max(map(len, text.splitlines())) <= 100


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


def test_the_file_in_the_documentation_is_right():
    text = (Path(__file__).parents[2] / "docs" / "guides" / "teach.md").read_text(encoding="utf-8")
    (region,) = parse_knowledge(text.split("```yaml\n")[1].split("```")[0], "docs").regions
    assert [process.kind for process in region.processes] == ["sand", "oil"]
    fields = set(Process.model_fields) - {"label"}
    assert all(f"`{field}`" in text for field in fields), "docs/guides/teach.md leaves out a field"


def test_names_are_those_of_the_planner_and_of_clouds():
    assert set(get_args(Trajectory)) == {*TRAJECTORIES, "taught"}
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
