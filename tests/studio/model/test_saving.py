"""What is saved can be read by the command line, and stays in the session's folder."""

from __future__ import annotations

import json
import zipfile
from io import BytesIO

import numpy as np
import pytest

from builders.studio_page import face, silent, small_box
from nrdf.io.cloud import write_cloud
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
from nrdf.studio.model.studio_cell import StudioCell
from nrdf.studio.model.uploads import read_knowledge_zip
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
    got = painted.add_target(name, small_box(seed=1))
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
    programs = save_programs(editor, "new", result, ("csv", "urscript"), StudioCell())
    names = zipfile.ZipFile(BytesIO(zipped(programs))).namelist()
    assert any(name.endswith(".csv") for name in names)
    assert all(name.startswith("programs/") for name in names)
    assert save_picture(editor, results).read_bytes().startswith(b"\x89PNG")
    json.loads((place / "report.json").read_text())


def full_knowledge():
    """Knowledge on a box that has what the page has no field for."""
    pad = {"name": "pad", "radius_m": 0.02, "pad": {"preston_per_pa": 1e-9}}
    gun = {
        "name": "gun", "radius_m": 0.03, "tcp_m": [0.0, 0.0, 0.2], "body_length_m": 0.3,
        "body_radius_m": 0.04, "profile": {"across_m": 0.06, "along_m": 0.03, "flow_m3_s": 1e-7},
    }  # fmt: skip
    return {
        "category": "chiar", "allow_unusual": True, "allow_overlap": True,
        "origin": {"written by": "hand"},
        "reference": {"cloud": "box.ply", "unit": "m"},
        "regions": [
            {
                "name": "top", "file": "top.npy", "fill_holes": True,
                "processes": [
                    {"kind": "paint", "tool": gun, "stepover_m": 0.03, "standoff_m": 0.2,
                     "feed_m_s": 0.3, "thickness_um": "60 ± 10", "order": 4, "run_off_m": 0.03,
                     "feed_limits": {"most_m_s": 0.8}, "parameters": {"colour": "RAL 9010"}},
                    {"kind": "sand", "tool": pad, "stepover_m": 0.02, "force_n": 15.0,
                     "feed_m_s": 0.1, "spindle_rad_s": 500.0, "line_order": "snake",
                     "removal_um": {"value": 30, "tolerance": 10, "most": 60}},
                ],
            }
        ],
    }  # fmt: skip


def test_nothing_of_a_file_is_lost_when_it_is_opened_edited_and_saved(tmp_path):
    folder = tmp_path / "given"
    folder.mkdir()
    write_cloud(folder / "box.ply", small_box())
    np.save(folder / "top.npy", face(small_box(), "top"))
    (folder / "any.yaml").write_text(json.dumps(full_knowledge()))
    given = read_knowledge(folder / "any.yaml")
    Editor(Session(tmp_path / "s")).open_knowledge("x", read_knowledge_zip("k.zip", zipped(folder)))
    editor = Editor(Session(tmp_path / "s"))  # as the program finds it when it is started again
    editor.change_numbers("top", 0, {"feed_mm_s": 250.0})
    saved = read_knowledge(save_knowledge(editor) / "chiar.yaml")
    (region,), (before,) = saved.regions, given.regions
    assert region.processes[0].feed_m_s == 0.25
    assert region.processes[0].model_copy(update={"feed_m_s": 0.3}) == before.processes[0]
    assert region.processes[1] == before.processes[1]
    ways = {"file", "indices", "processes"}
    assert region.model_dump(exclude=ways) == before.model_dump(exclude=ways)
    assert region.indices == np.flatnonzero(face(small_box(), "top")).tolist()
    ways = {"reference", "regions"}
    assert saved.model_dump(exclude=ways) == given.model_dump(exclude=ways)
