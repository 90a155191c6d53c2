"""Work in the background, and what it shows."""

from __future__ import annotations

from nrdf.studio.model.document import REFERENCE


def test_similarity_follows_the_picked_point(page):
    studio = page.studio
    page.transfer()
    assert "pick a point of the reference" in page.does(studio.compare, "new", 3)
    page.does(studio.compare, REFERENCE, 3)
    first = studio.descriptor_distances("new")
    assert studio.colouring == "similarity" and studio.descriptor_distances(REFERENCE).argmin() == 3
    with studio.reporting_errors():
        studio.compare(REFERENCE, 700)
    assert not studio.worker.busy, "at once"
    assert studio.descriptor_distances(REFERENCE).argmin() == 700
    assert (studio.descriptor_distances("new") != first).any()
    page.does(studio.panel.targets._add, "rocker")
    page.transfer()
    page.does(studio.compare, REFERENCE, 3)
    assert studio.descriptor_distances("rocker") is not None, "what came later too"


def test_without_a_model_or_a_result(page):
    assert "nothing is transferred to a target" in page.does(
        page.studio.arm_simulation.start, "new"
    )
    page.weights = None
    assert "no model for 'chair'" in page.transfer()
    assert "no model for 'chair'" in page.studio.panel.error.content, "until the next act"
    page.does(page.studio.panel.regions.undo)
    assert not page.studio.panel.error.visible
