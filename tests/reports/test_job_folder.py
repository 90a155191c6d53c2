"""A job's folder: what is in it can be read again, and its HTML report needs nothing else."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest

import nrdf
from builders.taught_box import SAND, bound_knowledge, cloud, made_up, solid
from nrdf.errors import OutputError
from nrdf.geometry.similarity import Similarity, up_axis, upright
from nrdf.io.cloud import read_cloud
from nrdf.process.bound_knowledge import read_bound_knowledge
from nrdf.process.check import check_knowledge
from nrdf.process.limits import Limits
from nrdf.process.transfer import ProcessTransfer
from nrdf.reports.job_folder import job_of, panel_of, write_job, write_job_files
from nrdf.toolpath.file import read_toolpaths

PAINT = {
    "kind": "paint", "stepover_mm": 60, "standoff_mm": 100, "tool": {"radius_mm": 40},
    "feed_mm_s": 300, "direction": [1, 0, 0],
}  # fmt: skip


@pytest.fixture(scope="module")
def transferred(untrained):
    processes = {"top": [SAND, {**SAND, "kind": "oil", "transfer": "warp"}], "right": [PAINT]}
    teacher = ProcessTransfer(bound_knowledge(processes), nrdf.load_model(untrained))
    return teacher.transfer(solid(seed=1))


@pytest.fixture(scope="module")
def folder(transferred, tmp_path_factory):
    folder = tmp_path_factory.mktemp("job")
    origin = {"command": "nrdf transfer <x>", "model": {"name": "chair"}, "knowledge": "k.yaml"}
    write_job_files(folder, transferred, Limits(max_cycle_time_s=0.0), "new & <old>", origin)
    return folder


def test_every_file_is_there_and_listed(folder):
    found = sorted(str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file())
    assert found == sorted(json.loads((folder / "report.json").read_text())["files"])
    assert found == [
        "knowledge.yaml", "picture.png", "region_meshes/right.ply", "region_meshes/top.ply",
        "regions/right.ply", "regions/top.ply", "report.html", "report.json", "surface.ply",
        "target.ply", "toolpaths.json",
    ]  # fmt: skip


def test_the_job_is_read_again(folder, transferred):
    job = read_toolpaths(folder)
    assert (job.category, job.frame) == ("chair", "target")
    assert [(path.region, path.process) for path in job.paths] == [
        ("top", "sand"), ("top", "oil"), ("right", "paint"),
    ]  # fmt: skip
    for read, made in zip(job.paths, job_of(transferred).paths, strict=True):
        for one, other in zip(read.segments, made.segments, strict=True):
            np.testing.assert_array_equal(one.positions, other.positions)
    assert job.paths[2].segments[1].force_n is None


def test_the_job_says_how_its_object_lies(transferred, tmp_path):
    """As for a scan that was given with z up: chairs must not lie on their side in the cell."""
    lying = Similarity(upright(up_axis("z")), np.array([1.0, 2.0, 3.0]), 0.9)
    report = write_job_files(tmp_path, replace(transferred, pose=lying), Limits(), "scan", {})
    job = read_toolpaths(tmp_path)
    np.testing.assert_allclose(job.pose.rotation, lying.rotation, atol=1e-12)
    np.testing.assert_allclose(job.pose.translation, lying.translation)
    assert job.pose.scale == 0.9
    np.testing.assert_allclose(job.up, [0, 0, 1], atol=1e-12)
    assert report["pose"] == json.loads((tmp_path / "toolpaths.json").read_text())["pose"]


def test_processes_of_one_kind_on_one_region_keep_their_own_names(untrained, tmp_path):
    """A path knows which of them made it, up to the job's own knowledge."""
    wide = {**SAND, "stepover_mm": 45, "standoff_mm": 0, "feed_mm_s": 50}
    eats_all = {**SAND, "edge_margin_mm": 400}
    teacher = ProcessTransfer(
        bound_knowledge({"top": [eats_all, SAND, wide, PAINT]}), nrdf.load_model(untrained)
    )
    result = teacher.transfer(cloud(seed=1))
    assert [step.process.label for step in result.paths] == ["sand", "sand 2", "sand 3", "paint"]
    assert result.paths[0].path is None
    write_job_files(tmp_path, result, Limits(), "twice", {})
    made = read_bound_knowledge(tmp_path / "knowledge.yaml").knowledge.regions[0].processes
    feeds = {process.label: process.feed_m_s for process in made}
    assert feeds == {"sand 2": 0.1, "sand 3": 0.05, "paint": 0.3}
    for path in read_toolpaths(tmp_path).paths:
        work = [s for s in path.segments if s.kind == "process"]
        assert {s.feed_m_s for s in work} == {feeds[path.process]}


def test_the_targets_knowledge_is_as_good_as_the_taught_one(folder, transferred):
    again = read_bound_knowledge(folder / "knowledge.yaml")
    for name, indices in again.regions.items():
        np.testing.assert_array_equal(indices, transferred.regions[name].match.indices)
    sand, oil = again.knowledge.regions[0].processes
    assert (sand.transfer_mode, oil.transfer_mode, oil.trajectory) == ("replan", "warp", "taught")
    assert again.knowledge.origin["knowledge"] == "k.yaml"
    np.testing.assert_allclose(again.cloud.normals, transferred.target.normals, atol=1e-6)
    checked = check_knowledge(again)
    assert [row.fault for row in checked] == ["", "", ""]
    for row, step in zip(checked, transferred.paths, strict=True):
        assert row.metrics.coverage == pytest.approx(step.metrics.coverage, abs=0.03)


def test_a_job_is_written_whole_and_replaced_only_if_asked(tmp_path):
    place = tmp_path / "job"
    write_job(place, made_up(missing="found nowhere"), "chair 7")
    assert json.loads((place / "report.json").read_text())["title"] == "chair 7"
    with pytest.raises(OutputError, match="not empty"):
        write_job(place, made_up(missing="found nowhere"))
    write_job(place, made_up(missing="found nowhere"), "chair 8", overwrite=True)
    assert json.loads((place / "report.json").read_text())["title"] == "chair 8"


def test_the_target_is_in_metres(folder):
    target = read_cloud(folder / "target.ply")
    assert target.unit == "m"
    np.testing.assert_allclose(target.points, cloud(seed=1).points, atol=1e-6)


def test_the_html_report_needs_no_network_and_escapes_what_it_shows(folder):
    page = (folder / "report.html").read_text()
    assert not re.search(r"(src|href)=\"(?!data:image/png;base64,)", page)
    assert "<script" not in page and "@import" not in page and "url(" not in page
    assert page.count("data:image/png;base64,") == 1 + 3
    assert "new &amp; &lt;old&gt;" in page and "<old>" not in page and "&lt;x&gt;" in page
    for shown in ("Limits not met", "sand", "oil", "paint", "warped from the reference", "40 mm"):
        assert shown in page


def test_lines_are_drawn_on_the_surface_also_of_tools_above_it(transferred):
    panel = panel_of(transferred, "title")
    assert set(panel.region_meshes) == set(panel.lines) == {"top", "right"}
    sides = np.concatenate(panel.lines["right"])
    np.testing.assert_allclose(sides[:, 2], transferred.target.points[:, 2].max(), atol=1e-9)
    assert sum(len(line) for line in panel.lines["top"]) > 2 * 0.5 * 0.9 / (0.04 * 0.02) / 1.5


def test_the_picture_stands_upright_whatever_the_targets_frame(transferred):
    turn = upright(up_axis("z"))
    lying = replace(transferred, pose=Similarity(turn, np.zeros(3), 1.0))
    straight, panel = panel_of(transferred, "title"), panel_of(lying, "title")
    np.testing.assert_allclose(panel.mesh.vertices, straight.mesh.vertices @ turn)
    for name, region in panel.region_meshes.items():
        np.testing.assert_allclose(region.vertices, straight.region_meshes[name].vertices @ turn)
    np.testing.assert_allclose(panel.lines["top"][0], straight.lines["top"][0] @ turn)


def test_nothing_found_is_a_report_all_the_same(tmp_path):
    skipped = made_up(missing="found nowhere on the target")
    report = write_job_files(tmp_path, skipped, Limits(), "none", {})
    assert report["total"]["paths"] == 0
    assert {path.name for path in tmp_path.iterdir()} == {
        "target.ply", "regions", "picture.png", "report.html", "report.json",
    }  # fmt: skip
    assert "found nowhere on the target" in (tmp_path / "report.html").read_text()
