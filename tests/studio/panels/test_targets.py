"""Targets: added, shown, corrected, removed, and their result in words."""

from __future__ import annotations

from builders.studio_page import face
from nrdf.studio.model.document import REFERENCE


def test_a_target_is_removed_and_corrections_are_discarded(page):
    tab, editor = page.studio.panel.targets, page.editor
    page.does(tab._add, "rocker")
    assert "choose a target" in page.does(tab._more, "Remove"), "there are two"
    page.does(tab._show, "rocker")
    assert page.studio.visible_objects() == [REFERENCE, "rocker"]
    page.does(tab._more, "Remove")
    assert editor.object_keys() == [REFERENCE, "new"] and page.studio.shown_target is None
    editor.paint("new", "top", face(editor.paintable("new").cloud, "top"))
    page.does(tab._more, "Discard corrections")
    assert not editor.target("new").corrected


def test_results_in_words(page):
    tab = page.studio.panel.targets
    page.does(tab.refresh)
    assert "press *Transfer the process*" in tab.status.content
    page.transfer()
    text = tab.status.content
    assert text.startswith("**new**: ") and "| region | process | confidence |" in text
    assert "top | sand |" in text and "before your last change" not in text
    page.editor.change_numbers("top", 0, {"stepover_mm": 15.0})
    page.does(tab.refresh)
    assert "**new** *(of before your last change)*" in tab.status.content


def test_what_is_missing_is_said(page):
    tab = page.studio.panel.targets
    page.editor.remove_target("new")
    assert "there is no target yet" in page.does(tab._transfer)
    assert "click a point of the reference first" in page.does(
        page.studio.recolour, "similarity", 0.1
    )
    page.editor.new_session()
    assert "there is no reference yet" in page.does(tab._add, "rocker")
