"""The session: every change on disk, undone and redone, restored; bad files refused."""

from __future__ import annotations

import json
import re
import shutil

import numpy as np
import pytest

from builders.taught_box import SIZE, cloud, faces
from nrdf.errors import OutputError, ProcessError, RegionError
from nrdf.process.bound_knowledge import read_bound_knowledge
from nrdf.process.knowledge_file import read_knowledge
from nrdf.studio.model.document import REFERENCE
from nrdf.studio.model.editor import Editor
from nrdf.studio.model.saving import saved_path
from nrdf.studio.model.session import Session
from nrdf.studio.model.session_file import FILE
from nrdf.studio.model.teaching import bound_knowledge_of, process_of, shown_numbers


@pytest.fixture
def editor(tmp_path):
    made = Editor(Session(tmp_path / "session"))
    made.open_reference("box.ply", cloud(), "chair")
    return made


@pytest.fixture
def painted(editor):
    editor.add_region("top")
    editor.paint(REFERENCE, "top", face(cloud(), "top"))
    return editor


def face(of, name):
    """A box's face as a mask of its points."""
    mask = np.zeros(len(of), bool)
    mask[faces(of)[name]] = True
    return mask


def again(editor):
    """The session as the program finds it when it is started again."""
    return Session(editor.session.folder)


def test_everything_is_there_after_a_crash(painted):
    painted.recolour_region("top", (1, 2, 3))
    painted.change_numbers("top", 0, {"stepover_mm": 12.0, "force_n": 0.0})
    painted.add_target("other.ply", cloud(SIZE, seed=1))
    mask = face(painted.paintable("other").cloud, "front")
    painted.paint("other", "top", mask)
    kept = again(painted).document
    assert kept.category == "chair" and kept.reference.name == "box.ply"
    np.testing.assert_allclose(kept.reference.cloud.points, cloud().points)
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
    painted.add_target("other.ply", cloud(SIZE, seed=1))
    painted.remove_target("other")
    assert painted.session.undo() and len(list((painted.session.folder / "clouds").iterdir())) == 2
    painted.session.redo()
    kept = again(painted)
    assert [p.name for p in (kept.folder / "clouds").iterdir()] == [kept.document.reference.file]


def test_starting_anew_can_be_undone(painted):
    painted.new_session()
    assert painted.object_keys() == [] and again(painted).document.reference is None
    assert painted.session.undo() and painted.object_keys() == [REFERENCE]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda c: {**c, "colour": 1}, "unknown key 'colour'"),
        (lambda c: {**c, "reference": {"name": "x", "file": "../../secret.ply"}}, "reference.file"),
        (lambda c: {**c, "reference": {"name": "x", "file": "cloud-9.ply"}}, "no file|cannot read"),
        (lambda c: {**c, "regions": [{**c["regions"][0], "indices": [10**6]}]}, "does not have"),
        (lambda c: {**c, "regions": [{**c["regions"][0], "colour": [300, 0, 0]}]}, "255"),
        (lambda c: {**c, "regions": [{**c["regions"][0], "steps": []}]}, "regions.0.steps"),
        (lambda c: {**c, "regions": [{**c["regions"][0], "name": "../x"}]}, "regions.0.name"),
        (lambda c: {**c, "regions": [*c["regions"], *c["regions"]]}, "twice"),
        (lambda c: {**c, "targets": [{**c["targets"][0], "name": ".."}]}, "targets.0.name"),
        (lambda c: {**c, "targets": [{**c["targets"][0], "name": "a/b"}]}, "targets.0.name"),
        (lambda c: {**c, "targets": [{**c["targets"][0], "name": "reference"}]}, "no name"),
        (lambda c: {**c, "version": 0}, "version"),
        (lambda c: [], "must be a mapping"),
    ],
)
def test_a_session_that_is_damaged_is_kept_aside_whole(painted, change, message):
    painted.add_target("other.ply", cloud(SIZE, seed=1))
    folder = painted.session.folder
    path = folder / FILE
    path.write_text(json.dumps(change(json.loads(path.read_text()))))
    before = {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()}
    fresh = again(painted)
    assert re.search(message, fresh.damage) and "damaged-1" in fresh.damage
    assert fresh.document.reference is None and not fresh.restored
    aside = folder / "damaged-1"
    after = {p.relative_to(aside): p.read_bytes() for p in aside.rglob("*") if p.is_file()}
    assert after == before
    assert again(painted).damage == "", "the new one is whole"


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


def test_a_session_of_a_newer_version_is_left_alone(painted):
    path = painted.session.folder / FILE
    content = {**json.loads(path.read_text()), "version": 9, "arms": []}
    path.write_text(json.dumps(content))
    with pytest.raises(ProcessError, match=r"from a newer nrdf.*--session"):
        again(painted)
    assert json.loads(path.read_text()) == content


def test_a_session_file_that_is_no_file_is_said(painted):
    path = painted.session.folder / FILE
    path.unlink()
    path.mkdir()
    with pytest.raises(OutputError, match="--session"):
        again(painted)


def test_a_folder_that_cannot_be_made_is_said(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="--session"):
        Session(tmp_path / "file" / "session")


def test_names_of_regions(painted):
    painted.add_region("front")
    with pytest.raises(RegionError, match="'top' already"):
        painted.rename_region("front", "top")
    for name in ("", "../x", "a/b", "a" * 101):
        with pytest.raises(RegionError, match="no name for a region"):
            painted.rename_region("front", name)
    painted.rename_region("front", " left side ")
    assert [r.name for r in painted.document.regions] == ["top", "left side"]
    assert painted.add_region("top") == "top-2" and painted.add_region() == "region-1"


def test_corrections_follow_their_region(painted):
    painted.add_target("other.ply", cloud(SIZE, seed=1))
    painted.paint("other", "top", face(painted.paintable("other").cloud, "top"))
    painted.rename_region("top", "lid")
    assert list(painted.target("other").corrected) == ["lid"]
    painted.discard_corrections("other")
    assert not painted.target("other").corrected
    painted.paint("other", "lid", face(painted.paintable("other").cloud, "top"))
    painted.remove_region("lid")
    assert not painted.target("other").corrected


def test_names_of_targets_are_no_paths_and_differ(painted):
    names = [painted.add_target("../../etc/passwd.ply", cloud(SIZE, seed=1)) for _ in range(2)]
    assert names == ["passwd", "passwd-2"]
    files = sorted(p.name for p in (painted.session.folder / "clouds").iterdir())
    assert files == ["cloud-1.ply", "cloud-2.ply", "cloud-3.ply"]
    painted.remove_target("passwd")
    assert painted.object_keys() == [REFERENCE, "passwd-2"]


def test_overlaps_are_told(painted):
    painted.add_region("front")
    painted.paint(REFERENCE, "front", painted.document.region("top").mask)
    assert "top" in painted.overlaps()[0] and "front" in painted.overlaps()[0]
    with pytest.raises(ProcessError, match="overlap"):
        bound_knowledge_of(painted.session.clouds, painted.document)
    painted.allow_overlap(True)
    assert len(bound_knowledge_of(painted.session.clouds, painted.document).regions) == 2


def test_steps(painted):
    assert painted.add_step("top", "oil") == 1
    painted.change_step("top", 1, trajectory="spiral", direction=[1.0, 0.0, 0.0])
    painted.change_step("top", 1, direction=None)
    oil = process_of(painted.document.region("top"), 1)
    assert (oil.kind, oil.trajectory, oil.direction) == ("oil", "spiral", None)
    painted.restart_step("top", 0, "paint")
    assert process_of(painted.document.region("top"), 0).standoff_m == pytest.approx(0.2)
    painted.remove_step("top", 0)
    with pytest.raises(RegionError, match="at least one process"):
        painted.remove_step("top", 0)


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
    editor.open_reference("box.ply", cloud(), "chair")
    editor.add_region()
    with pytest.raises(ProcessError, match="step 2"):
        bound_knowledge_of(editor.session.clouds, editor.document)


def test_knowledge_goes_out_and_comes_back(painted, tmp_path):
    from nrdf.studio.model.saving import save_knowledge

    painted.change_step("top", 0, parameters={"grit": 120})
    place = save_knowledge(painted)
    assert save_knowledge(painted) == place, "it can be saved again"
    lesson = read_bound_knowledge(place / "chair.yaml")
    assert read_knowledge(place / "chair.yaml").regions[0].processes[0].parameters["grit"] == 120
    other = Editor(Session(tmp_path / "other"))
    other.open_knowledge("reference", lesson)
    (region,) = other.document.regions
    assert (region.mask == painted.document.regions[0].mask).all()
    (step,), (made,) = region.steps, painted.document.regions[0].steps
    assert step.keys() == made.keys() and step["parameters"] == {"grit": 120}
    assert step["stepover_m"] == pytest.approx(made["stepover_m"])


@pytest.mark.parametrize("name", ["...ply", "..", "/etc/..ply", "con.ply", "C:\\..\\..ply"])
def test_no_name_of_an_upload_leads_out_of_the_sessions_folder(painted, name):
    got = painted.add_target(name, cloud(SIZE, seed=1))
    assert got not in ("", ".", "..") and "/" not in got and "\\" not in got
    saved = painted.session.folder / "saved"
    assert saved_path(painted, got, "job") == saved / got / "job"


def test_names_in_a_session_that_somebody_else_wrote_do_not_lead_out_of_its_folder(painted):
    saved = painted.session.folder / "saved"
    for name in ("..", "../..", "/tmp", "a/../../b"):
        place = saved_path(painted, name, "job")
        assert place.parent.parent == saved and place.name == "job"
