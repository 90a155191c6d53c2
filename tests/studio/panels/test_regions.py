"""Regions that are refused."""

from __future__ import annotations

from builders.studio_page import face, small_box
from builders.taught_box import faces
from nrdf.studio.model.document import REFERENCE


def test_regions_that_cannot_be(page):
    assert "'front' already" in page.does(page.studio.panel.regions._rename, "front")
    page.paint("front", faces(small_box())["top"])
    assert "tick 'Regions may overlap'" in page.transfer()
    page.paint("front", [])
    said = page.transfer()
    assert "front: no points yet" in said and page.studio.results.is_current("new")
    page.paint("top", [])
    assert "no region is painted yet: paint one in step 2" in page.transfer()


def test_a_region_is_made_mirrored_cleared_and_deleted(page):
    tab, editor, studio = page.studio.panel.regions, page.editor, page.studio
    page.does(tab._new)
    assert studio.region == "region-1" and studio.mouse.tool == "Grow"
    left = face(small_box(), "top") & (small_box().points[:, 2] < -0.05)
    editor.paint(REFERENCE, "region-1", left)
    page.does(tab._more, "Mirror")
    both = editor.document.region("region-1").mask
    assert both[left].all() and both.sum() > 1.5 * left.sum()
    page.does(tab._more, "Clear")
    assert not editor.document.region("region-1").mask.any()
    page.does(tab._more, "Delete")
    assert editor.document.region("region-1") is None and studio.region == "front"
