"""What is saved can be read by the command line, and stays in the session's folder."""

from __future__ import annotations

import json
import zipfile
from io import BytesIO

import pytest

from builders.studio_page import silent
from builders.taught_box import SIZE, cloud
from nrdf.process.bound_knowledge import read_bound_knowledge
from nrdf.process.knowledge_file import read_knowledge
from nrdf.studio.model.editor import Editor
from nrdf.studio.model.saving import (
    save_job,
    save_knowledge,
    save_picture,
    save_programs,
    saved_path,
    zipped,
)
from nrdf.studio.model.session import Session
from nrdf.toolpath.file import read_toolpaths


def test_knowledge_goes_out_and_comes_back(painted, tmp_path):

    painted.change_step("top", 0, parameters={"grit": 120})
    place = save_knowledge(painted)
    assert save_knowledge(painted) == place, "it can be saved again"
    bound_knowledge = read_bound_knowledge(place / "chair.yaml")
    assert read_knowledge(place / "chair.yaml").regions[0].processes[0].parameters["grit"] == 120
    other = Editor(Session(tmp_path / "other"))
    other.open_knowledge("reference", bound_knowledge)
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


def test_what_is_saved_can_be_read_by_the_command_line(results):
    editor = results.editor
    results.make_plans(editor.document, silent)
    results.transfer(editor.document, silent)
    result = results.by_target["new"]
    place = save_job(editor, "new", result, {"command": "nrdf studio"})
    assert save_job(editor, "new", result, {}) == place, "it can be saved again"
    assert len(read_toolpaths(place).paths) == 2 and (place / "report.html").is_file()
    assert list(read_bound_knowledge(place / "knowledge.yaml").regions) == ["top", "front"]
    programs = save_programs(editor, "new", result, ("csv", "urscript"))
    names = zipfile.ZipFile(BytesIO(zipped(programs))).namelist()
    assert any(name.endswith(".csv") for name in names)
    assert all(name.startswith("programs/") for name in names)
    assert save_picture(editor, results).read_bytes().startswith(b"\x89PNG")
    json.loads((place / "report.json").read_text())
