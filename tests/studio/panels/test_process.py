"""Numbers of a process that are refused, and the tool's clearance."""

from __future__ import annotations

from typing import NamedTuple


class Given(NamedTuple):
    """What a page's field sends."""

    value: float


def test_numbers_that_cannot_be_are_named_as_on_the_page(page):
    status = page.change(feed_mm_s=0.0)
    assert status.startswith("⚠ region 'top'")
    assert "feed_m_s (*Feed, mm/s*): must be above 0.0, not 0.0" in status
    assert "feed_m_s: must be above 0.0" in page.transfer()
    status = page.change(feed_mm_s=100.0, stepover_mm=2000.0)
    assert "stepover_m (*Stepover, mm*) is 2 (2000 mm), above what is plausible" in status


def test_tool_clearance(page):
    tab = page.studio.panel.process
    page.does(tab.refresh)
    assert tab.tool_clearance.value == 20.0
    page.does(tab._set_length, "clearance_m", Given(35.0))
    assert page.editor.document.region("top").steps[0]["tool"]["clearance_m"] == 0.035
    page.does(tab._set_length, "clearance_m", Given(-1.0))
    page.does(tab.refresh)
    assert "clearance_m" in tab.status.content and "-0.001" in tab.status.content


def test_steps_are_added_selected_and_removed(page):
    tab, studio = page.studio.panel.process, page.studio
    tab.kind.value = "polish"
    page.does(tab._change_steps, "Add")
    assert studio.step == 1 and tab.step.options == ("1: sand", "2: polish")
    page.does(tab._select_step, "1: sand")
    assert studio.step == 0 and tab.kind.value == "sand"
    page.does(tab._change_steps, "Remove")
    assert [step["kind"] for step in page.editor.document.region("top").steps] == ["polish"]
    assert "at least one process" in page.does(tab._change_steps, "Remove")


def test_the_body_of_the_tool_and_what_the_page_has_no_field_for(page):
    tab, editor = page.studio.panel.process, page.editor
    tool = {"name": "gun", "radius_m": 0.03, "body_length_m": 0.3, "pad": {"preston_per_pa": 1e-9}}
    top = editor.document.region("top").mask
    page.paint("top", [])  # without points nothing is planned
    page.paint("front", [])
    wanted = {"value": 60.0, "tolerance": 10.0}
    editor.change_step("top", 0, tool=tool, removal_um=wanted, order=3)
    page.does(tab.refresh)
    assert tab.body["body_length_m"].value == 300.0 and tab.body["body_radius_m"].value == 0.0
    assert "removal_um **60 ± 10 µm**" in tab.status.content
    assert "kept as it is: line_order, " in tab.status.content
    assert "order, tool.pad." in tab.status.content
    page.does(tab._set_length, "body_radius_m", Given(45.0))
    step = editor.document.region("top").steps[0]
    assert step["tool"] == {**tool, "body_radius_m": 0.045}
    assert step["removal_um"] == wanted and step["order"] == 3
    page.paint("top", top)
    page.does(tab._set_length, "body_length_m", Given(0.0))
    assert "body_radius_m needs body_length_m" in page.change(feed_mm_s=100.0)
