"""From a document to process knowledge, and its numbers as the page shows them."""

from __future__ import annotations

import numpy as np
import pytest

from builders.studio_page import small_box
from nrdf.errors import ProcessError
from nrdf.studio.model.editor import Editor
from nrdf.studio.model.session import Session
from nrdf.studio.model.teaching import bound_knowledge_of, process_of, shown_numbers


def again(editor):
    """The session as the program finds it when it is started again."""
    return Session(editor.session.folder)


def test_numbers_as_the_page_shows_them(painted):
    shown = {"stepover_mm": 17.5, "feed_mm_s": 120.0, "tilt_deg": 12.0, "passes": 2.0}
    painted.change_numbers("top", 0, shown | {"spindle_rpm": 3000.0})
    process = process_of(painted.document.region("top"), 0)
    assert process.stepover_m == pytest.approx(0.0175) and process.passes == 2
    assert process.tilt_rad == pytest.approx(np.radians(12))
    found = shown_numbers(painted.document.region("top").steps[0])
    assert {k: found[k] for k in shown} == shown and found["spindle_rpm"] == 3000.0


@pytest.mark.parametrize(
    ("shown", "message"),
    [
        ({"feed_mm_s": -5.0}, r"region 'top', process 1 \(sand\), feed_m_s.*-0.005"),
        ({"passes": 0.0}, "passes"),
        ({"standoff_mm": 10.0}, "force without contact"),
        ({"force_tolerance_n": 40.0}, "force_tolerance_n is 40"),
        ({"tilt_deg": 95.0}, "tilt_rad"),
    ],
)
def test_wrong_numbers_are_named_by_field_and_value(painted, shown, message):
    painted.change_numbers("top", 0, shown)
    with pytest.raises(ProcessError, match=message):
        process_of(painted.document.region("top"), 0)
    assert again(painted).document.regions[0].steps == painted.document.regions[0].steps


def test_knowledge_needs_a_reference_and_a_region(tmp_path):
    editor = Editor(Session(tmp_path / "session"))
    with pytest.raises(ProcessError, match="step 1"):
        bound_knowledge_of(editor.session.clouds, editor.document)
    editor.open_reference("box.ply", small_box(), "chair")
    editor.add_region()
    with pytest.raises(ProcessError, match="step 2"):
        bound_knowledge_of(editor.session.clouds, editor.document)
