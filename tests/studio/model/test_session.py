"""The session: every change on disk, undone and redone, restored."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

from builders.studio_page import face, small_box
from nrdf.errors import OutputError
from nrdf.studio.model.document import REFERENCE
from nrdf.studio.model.session import Session
from nrdf.studio.model.session_file import FILE


def again(editor):
    """The session as the program finds it when it is started again."""
    return Session(editor.session.folder)


def test_everything_is_there_after_a_crash(painted):
    painted.recolour_region("top", (1, 2, 3))
    painted.change_numbers("top", 0, {"stepover_mm": 12.0, "force_n": 0.0})
    painted.add_target("other.ply", small_box(seed=1))
    mask = face(painted.paintable("other").cloud, "front")
    painted.paint("other", "top", mask)
    kept = again(painted).document
    assert kept.category == "chair" and kept.reference.name == "box.ply"
    np.testing.assert_allclose(kept.reference.cloud.points, small_box().points)
    (region,) = kept.regions
    assert (region.mask == painted.document.regions[0].mask).all() and region.colour == (1, 2, 3)
    assert region.steps[0]["stepover_m"] == pytest.approx(0.012)
    assert "force_n" not in region.steps[0]
    assert (kept.targets[0].corrected["top"] == mask).all()


def test_undo_and_redo_also_on_disk(painted):
    mask = painted.document.region("top").mask
    painted.paint(REFERENCE, "top", ~mask)
    painted.paint(REFERENCE, "top", np.zeros_like(mask), merge=True)
    assert painted.session.undo()
    assert (again(painted).document.region("top").mask == mask).all()
    assert painted.session.redo() and not painted.document.region("top").mask.any()
    assert not painted.session.redo()
    painted.session.undo()
    painted.add_region("front")
    assert not painted.session.redo(), "what came after an undone change is gone"


def test_clouds_that_nothing_needs_any_more_go_when_it_starts_again(painted):
    painted.add_target("other.ply", small_box(seed=1))
    painted.remove_target("other")
    assert painted.session.undo() and len(list((painted.session.folder / "clouds").iterdir())) == 2
    painted.session.redo()
    kept = again(painted)
    assert [p.name for p in (kept.folder / "clouds").iterdir()] == [kept.document.reference.file]


def test_starting_anew_can_be_undone(painted):
    painted.new_session()
    assert painted.object_keys() == [] and again(painted).document.reference is None
    assert painted.session.undo() and painted.object_keys() == [REFERENCE]


def test_what_was_put_aside_can_be_put_back(painted):
    folder = painted.session.folder
    text = (folder / FILE).read_bytes()
    (folder / FILE).write_bytes(text[:-7])
    assert again(painted).damage
    shutil.rmtree(folder / "clouds")
    (folder / "damaged-1" / "clouds").rename(folder / "clouds")
    (folder / FILE).write_bytes(text)
    kept = again(painted).document
    assert kept.reference.name == "box.ply" and [r.name for r in kept.regions] == ["top"]


def test_a_folder_that_cannot_be_made_is_said(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="--session"):
        Session(tmp_path / "file" / "session")
