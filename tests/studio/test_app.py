"""A studio: its objects side by side."""

from __future__ import annotations

from itertools import pairwise

from nrdf.studio.model.document import REFERENCE
from nrdf.studio.model.uploads import BUNDLED
from nrdf.studio.panels.targets import ALL


def test_several_targets_stand_side_by_side(page):
    page.does(page.studio.panel.targets._add, ALL)
    keys = [REFERENCE, "new", *BUNDLED[1:]]
    assert page.studio.visible_objects() == keys == list(page.studio.scene.objects)
    spans = [object_view.corners[:, 2] for object_view in page.studio.scene.objects.values()]
    assert all(a.min() > b.max() for a, b in pairwise(spans)), "none overlap"
    page.does(page.studio.panel.targets._show, "rocker")
    assert page.studio.visible_objects() == [REFERENCE, "rocker"]
