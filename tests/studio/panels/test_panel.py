"""The panel says what to do next, and shows the selected region and tool."""

from __future__ import annotations

from builders.studio_page import face, small_box
from nrdf.studio.model.document import REFERENCE


def test_the_next_step_follows_what_is_done(page):
    from nrdf.studio.panels.panel import next_step

    editor, studio = page.editor, page.studio
    assert next_step(studio) == "in **4 Targets**, press *Transfer the process* (new)."
    page.transfer()
    said = next_step(studio)
    assert said.startswith(("check new", "save what you need")), "a result"
    editor.remove_target("new")
    assert "go to **4 Targets**" in next_step(studio)
    page.paint("front", [])
    assert "where **front** is" in next_step(studio)
    for name in ("top", "front"):
        editor.remove_region(name)
    assert next_step(studio) == "in **2 Regions**, press *New region*."
    editor.new_session()
    assert next_step(studio) == "open a reference in **1 Reference**."


def test_another_region_is_selected_with_its_first_step(page):
    panel, studio = page.studio.panel, page.studio
    studio.step = 3
    page.does(panel._select_region, "front")
    assert (studio.region, studio.step) == ("front", 0) and panel.region.value == "front"
    page.does(panel.take, "Brush")
    assert page.studio.mouse.tool == "Brush" and "**Brush**" in panel.hint.content


def test_undo_takes_the_last_change_back(page):
    page.editor.paint(REFERENCE, "top", face(small_box(), "front"))
    page.does(page.studio.panel.regions.undo)
    assert (page.editor.document.region("top").mask == face(small_box(), "top")).all()
    page.does(page.studio.panel.regions.redo)
    assert (page.editor.document.region("top").mask == face(small_box(), "front")).all()
    assert "nothing to redo" in page.does(page.studio.panel.regions.redo)
