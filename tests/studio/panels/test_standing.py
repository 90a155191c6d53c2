"""A scan in any pose on the page: proposed, turned, cleaned otherwise, confirmed, transferred."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from builders.lying_scan import ANY, lying_scan
from nrdf.bundled import bundled_chair
from nrdf.io.cloud import write_cloud
from nrdf.process.limits import strict_warnings
from nrdf.regions.reference import EncodedReference
from nrdf.scans.kind_check import KindCheck
from nrdf.studio.model.document import REFERENCE
from nrdf.studio.model.session_file import read_document
from nrdf.studio.panels.panel import next_step
from nrdf.studio.panels.standing import BY_HAND
from nrdf.studio.scene.drawing import lines_of


@pytest.fixture
def scanned(page, tmp_path):
    """A page with a chair as its reference, and a scan of another one just loaded."""
    page.weights = "registration"
    reference, regions = bundled_chair("reference")
    page.editor.open_reference("chair", reference, "chair")
    page.editor.add_region("seat")
    mask = np.zeros(len(reference), bool)
    mask[regions["seat"]] = True
    page.editor.paint(REFERENCE, "seat", mask)
    page.does(page.studio.restore)
    write_cloud(tmp_path / "scan.ply", lying_scan())
    content = (tmp_path / "scan.ply").read_bytes()
    file = SimpleNamespace(name="scan.ply", content=content)
    assert page.does(page.studio.panel.targets._load, file) == ""
    return page


def stands(page):
    """The chair's axes of front and up, as the page shows them."""
    upright = page.studio.scene.objects["scan"].upright
    return upright @ ANY[:, 0], upright @ ANY[:, 1]


def test_a_pose_is_proposed_corrected_and_confirmed(scanned):
    folder, studio = scanned.studio.panel.targets.standing, scanned.studio
    assert folder.folder.visible and "say in **4 Targets** how scan stands" in next_step(studio)
    assert "removed, shown in red: floor 1" in folder.status.content
    assert folder.pose.value.startswith("1: ") and "as in the file" in folder.pose.options[-1]
    view = studio.scene.objects["scan"]
    assert view._removed is not None and "front" in view._arrows
    front, up = stands(scanned)
    assert front[0] > 0.95 and up[1] > 0.98
    assert view.corners[:, 1].min() == pytest.approx(0.0, abs=1e-9), "it stands on the floor"

    scanned.does(folder._turn, "Back")
    assert folder.pose.value == BY_HAND and stands(scanned)[1][0] < -0.9
    scanned.does(studio.panel.regions.undo)
    assert stands(scanned)[1][1] > 0.98
    scanned.does(folder._choose, folder.pose.options[-1])
    assert np.array_equal(studio.scene.objects["scan"].upright, np.eye(3))
    scanned.does(studio.panel.regions.undo)

    scanned.does(folder._confirm)
    assert not folder.folder.visible and studio.scene.objects["scan"]._removed is None
    assert "Transfer the process" in next_step(studio)
    kept = read_document(scanned.editor.session.folder).targets[0].object
    assert kept.placement.confirmed and len(kept.scan.cloud) == 4000
    assert kept.placement.pose is kept.placement.poses[0]
    assert np.array_equal(kept.placement.upright, studio.scene.objects["scan"].upright)


def test_cleaning_is_taken_back_and_made_again(scanned):
    folder, editor = scanned.studio.panel.targets.standing, scanned.editor
    without = len(editor.target("scan").object.cloud)
    assert folder.steps["floor"].visible and folder.steps["floor"].value
    scanned.does(folder._clean, "floor", SimpleNamespace(value=False))
    target = editor.target("scan").object
    assert target.placement.skipped == ("floor",) and len(target.cloud) > without + 1000
    assert not folder.steps["floor"].value and folder.steps["floor"].visible
    scanned.does(scanned.studio.panel.regions.undo)
    assert len(editor.target("scan").object.cloud) == without
    assert "there is no object 3" in scanned.does(folder._take, "3 of 3")


def test_tool_paths_are_in_the_frame_of_the_scan(scanned, monkeypatch):
    turned = KindCheck("chair", "facing -Z", 0.0, ("it does not look upright",))
    monkeypatch.setattr(EncodedReference, "check_kind", lambda *_: turned)
    scanned.does(scanned.studio.panel.targets.standing._confirm)
    assert scanned.transfer() == ""
    result = scanned.studio.results.by_target["scan"].transfer_result
    assert result.kind.fits and not strict_warnings(result), "a person has confirmed the pose"
    there = result.target.points[result.regions["seat"].match.indices]
    chair, regions = bundled_chair("ladder-back")
    seat = chair.points[regions["seat"]].mean(axis=0) - [0.0, chair.points[:2500, 1].min(), 0.0]
    seat = ANY @ seat + [2.0, 0.05, -0.4]
    assert there.mean(axis=0) == pytest.approx(seat, abs=0.05)
    lines = np.concatenate(lines_of(scanned.editor, scanned.studio.results, "scan")["seat"][0])
    assert lines.mean(axis=0) == pytest.approx(seat, abs=0.08), "and so are those that are drawn"
    assert result.pose is not None and result.pose.rotation[:, 1] @ ANY[:, 1] > 0.98
