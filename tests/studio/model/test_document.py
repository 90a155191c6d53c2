"""Documents are replaced, never changed."""

from __future__ import annotations

import numpy as np

from nrdf.io.cloud import PointCloud
from nrdf.studio.model.document import Document, LoadedObject, PaintedRegion, Target

MASK = np.array([True, False])
DOCUMENT = Document(
    regions=(PaintedRegion("top", (1, 2, 3), MASK), PaintedRegion("front", (4, 5, 6), MASK)),
    targets=(Target(LoadedObject("new", PointCloud(np.zeros((2, 3))))),),
)


def test_a_changed_region_is_in_a_new_document():
    changed = DOCUMENT.with_region("top", called="lid", colour=(7, 8, 9))
    assert [r.name for r in changed.regions] == ["lid", "front"]
    assert changed.region("lid").colour == (7, 8, 9) and changed.region("top") is None
    assert DOCUMENT.region("top").colour == (1, 2, 3)
    assert changed.region("front") is DOCUMENT.region("front")


def test_a_changed_target_is_in_a_new_document():
    changed = DOCUMENT.with_target("new", corrected={"top": MASK})
    assert list(changed.targets[0].corrected) == ["top"] and not DOCUMENT.targets[0].corrected
    assert DOCUMENT.with_target("other", corrected={"top": MASK}).targets == DOCUMENT.targets
