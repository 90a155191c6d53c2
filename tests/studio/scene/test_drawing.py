"""What is drawn of an object: colours, lines and the arrow."""

from __future__ import annotations

import numpy as np

from builders.studio_page import silent
from nrdf.studio.model.document import REFERENCE
from nrdf.studio.scene.drawing import colours_of, direction_of, lines_of, region_meshes_of


def test_what_is_drawn(results):
    editor = results.editor
    bare = colours_of(editor, results, "new")
    assert (bare == bare[0]).all() and not lines_of(editor, results, "new")
    results.make_plans(editor.document, silent)
    results.transfer(editor.document, silent)
    assert set(lines_of(editor, results, REFERENCE)) == {"top", "front"}
    painted = colours_of(editor, results, REFERENCE)
    assert (painted[editor.document.region("top").mask] != bare[0]).any()
    assert direction_of(editor, "top", 0) is None
    editor.change_step("top", 0, direction=[1.0, 0.0, 0.0])
    start, stop = direction_of(editor, "top", 0)
    np.testing.assert_allclose((stop - start) / np.linalg.norm(stop - start), [1, 0, 0])
    meshes = region_meshes_of(editor, results, "new")
    assert set(meshes) == {"top", "front"}
    found = results.by_target["new"].transfer_result.regions["top"]
    assert meshes["top"][0] is found.mesh.mesh
    bare_again = colours_of(editor, results, "new", without=meshes)
    assert (bare_again == bare[0]).all(), "nothing is drawn twice"
    sure = colours_of(editor, results, "new", by_confidence=True)
    assert len(sure) == len(editor.paintable("new").points)


def test_overlaps_are_dark(results):
    from nrdf.viz.palette import SEVERAL_REGIONS

    editor = results.editor
    editor.paint(REFERENCE, "front", editor.document.region("top").mask)
    drawn = colours_of(editor, results, REFERENCE)
    assert (drawn[editor.document.region("top").mask] == np.array(SEVERAL_REGIONS)).all()
