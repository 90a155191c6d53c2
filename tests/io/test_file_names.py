"""Names that become file names, and cells of tables."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from nrdf.io.file_names import clashing_names, file_name_problem, safe_file_name, spreadsheet_text
from nrdf.process.knowledge import Knowledge
from nrdf.regions.region import region_name_fault
from nrdf.robot.report.trajectories import _quoted


@pytest.mark.parametrize(
    "name", ["seat", "back-front", "Sitzfläche 2", "座面", "con-seat", "console"]
)
def test_good_names_have_no_fault(name):
    assert region_name_fault(name) == file_name_problem(name) == ""
    assert safe_file_name(name, "x") == name


@pytest.mark.parametrize(
    "name, message",
    [
        ("con", "Windows keeps con for a device"),
        ("NUL.old", "Windows keeps NUL for a device"),
        ("com1", "for a device"),
        ("lpt9 .x", "for a device"),
        ("seat.", "ends with a dot or a space"),
        ("seat ", "ends with a dot or a space"),
        ("座" * 80, "it has 240 bytes, and a file's name has room for 200"),
    ],
)
def test_names_that_some_system_refuses_are_told_why(name, message):
    assert message in region_name_fault(name)


@pytest.mark.parametrize("name", ["", ".", "..", "a/b", "a\\b", "a:b", "-x", "a\n", "s" * 101])
def test_names_that_no_region_can_have(name):
    assert region_name_fault(name)


@pytest.mark.parametrize(
    "name, usable",
    [
        ("..", "x"), ("", "x"), ("...", "x"), ("../../etc", "-..-etc"), ("a\\b:c", "a-b-c"),
        ("con", "con-"), ("nul.1", "nul.1-"), ("seat. ", "seat"), ("座" * 100, "座" * 66),
    ],
)  # fmt: skip
def test_any_name_has_a_usable_one_near(name, usable):
    found = safe_file_name(name, "x")
    assert found == usable
    assert "/" not in found and found not in (".", "..") and len(found.encode()) <= 201


def test_names_that_are_one_file_on_some_systems_are_found():
    assert clashing_names(["seat", "back", "Seat"]) == ("seat", "Seat")
    assert clashing_names(["Fläche", "Fla\u0308che"]) == ("Fläche", "Fla\u0308che")
    assert clashing_names(["seat", "back"]) is None


@pytest.mark.parametrize("text", ["=1+1", "+1", "-2", "@sum", "\t=1", "\r=1", "＝1"])
def test_formulas_become_text(text):
    assert spreadsheet_text(text) == f"'{text}"


@pytest.mark.parametrize("text", ["seat", "a=1", "a-b", "", "'x"])
def test_other_texts_stay(text):
    assert spreadsheet_text(text) == text


def test_knowledge_takes_no_names_that_some_system_cannot_tell_apart():
    def knowledge(*names):
        step = {"kind": "clean", "stepover_m": 0.01, "spacing_m": 0.01, "tool": {"radius_m": 0.01}}
        step |= {"feed_m_s": 0.1, "force_n": 5}
        rows = [{"name": name, "indices": [0, 1, 2], "processes": [step]} for name in names]
        content = {"category": "chair", "reference": {"cloud": "x.ply"}, "regions": rows}
        return Knowledge.model_validate(content)

    assert [region.name for region in knowledge("seat", "back").regions] == ["seat", "back"]
    with pytest.raises(ValidationError, match="'Seat' and 'seat' would be one file"):
        knowledge("Seat", "seat")
    with pytest.raises(ValidationError, match="Windows keeps nul for a device"):
        knowledge("nul")


@pytest.mark.parametrize(
    "name, cell",
    [("=1+1", "'=1+1"), ("=a,b", '"\'=a,b"'), ("joint_1", "joint_1"), ("a\rb", '"a\rb"')],
)
def test_names_in_joint_trajectories_are_text(name, cell):
    assert _quoted(name) == cell
