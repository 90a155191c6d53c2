"""Full disks, places that can only be read, killed and simultaneous runs, as a user meets them."""

from __future__ import annotations

import csv
import errno
import os
import sqlite3
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from builders.export_jobs import small_job
from builders.taught_box import cloud
from nrdf import cli
from nrdf.errors import OutputError
from nrdf.export.registry import export_job
from nrdf.io.locks import write_lock
from nrdf.io.result_folder import MANIFEST
from nrdf.toolpath.file import write_toolpaths

LIMITED = """
import resource, sys
from nrdf import cli
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]),) * 2)
sys.exit(cli.run(sys.argv[2:]))
"""


@pytest.fixture
def job(tmp_path):
    (tmp_path / "job").mkdir()
    write_toolpaths(tmp_path / "job", small_job())
    return tmp_path / "job"


def run(*words, code="import sys; from nrdf import cli; sys.exit(cli.run(sys.argv[1:]))", **more):
    command = [sys.executable, "-c", code, *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, **more)


@pytest.mark.skipif(os.name != "posix", reason="limits of a process")
def test_no_export_ends_in_a_traceback_where_files_cannot_grow(job):
    """One process and one limit for all formats: importing takes longer than writing."""
    pytest.importorskip("rosbags.rosbag2")
    code = """
import resource, sys
from pathlib import Path
from nrdf.errors import OutputError
from nrdf.export.registry import FORMATS, export_job
from nrdf.toolpath.file import read_toolpaths
import rosbags.rosbag2
job = read_toolpaths(sys.argv[1])
resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))
for name in FORMATS:
    try:
        export_job(job, [name], Path(sys.argv[2]))
        sys.exit(name + " was written")
    except OutputError as error:
        assert "cannot write" in str(error), error
"""
    done = run(job, job / "out", code=code)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.skipif(os.name != "posix", reason="limits of a process")
def test_a_bag_on_a_full_disk_is_an_error_in_words_and_leaves_nothing(job):
    pytest.importorskip("rosbags.rosbag2")
    done = run(4096, "export", job, "--format", "csv", "ros2-bag", code=LIMITED)
    assert done.returncode == 2 and "Traceback" not in done.stderr
    assert "cannot write" in done.stderr
    assert [p.name for p in job.iterdir()] == ["toolpaths.json"]


@pytest.mark.parametrize(
    "error",
    [
        OSError(errno.ENOSPC, "No space left on device"),
        OSError(errno.EROFS, "Read-only file system"),
        OSError(errno.EACCES, "Permission denied"),
        OSError(errno.ENAMETOOLONG, "File name too long"),
        sqlite3.OperationalError("database or disk is full"),
    ],
)
def test_every_bag_says_why_it_cannot_be_written(tmp_path, monkeypatch, error):
    writer = pytest.importorskip("rosbags.rosbag2").Writer

    def fails(*_):
        raise error

    monkeypatch.setattr(writer, "write", fails)
    with pytest.raises(OutputError, match=str(error.args[-1])):
        export_job(small_job(), ["ros2-bag"], tmp_path)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
@pytest.mark.parametrize("words", [["--help"], ["--version"]])
def test_output_that_nobody_can_take_is_no_traceback(words):
    code = "import sys; from nrdf import cli; sys.exit(cli.run(sys.argv[1:]))"
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-c", code, *words], stdout=full, stderr=subprocess.PIPE, text=True
        )
    assert "Traceback" not in done.stderr and done.returncode != 0
    assert "No space left on device" in done.stderr


def test_a_place_that_can_only_be_read_is_told_before_anything_is_computed(job, capsys):
    (job / "file").write_text("")
    for words in (
        ["export", job, "--format", "csv", "--out", job / "file" / "out"],
        ["demo", "--out", job / "file" / "out"],
        ["model", "scan", "no-such-mesh.ply", "--out", job / "file" / "out.ply"],
        ["model", "synth", "chair", "--count", "1", "--out", job / "file" / "out"],
        ["eval", "presence", "--out", job / "file" / "out"],
        ["eval", "speed", "--out", job / "file" / "speed.json"],
    ):
        assert cli.run([str(word) for word in words]) == 2
        said = " ".join(capsys.readouterr().err.split())
        assert "cannot write" in said and "file/" in said, said


@pytest.mark.parametrize(
    "words",
    [
        ["export", "JOB", "--format", "csv"],
        ["export", "JOB", "--format", "csv", "--overwrite"],
        ["retrieve", "--model", "x", "--reference", "x", "--region", "x", "--target", "x"],
        ["align", "scan.ply", "--model", "x"],
        ["transfer", "x.yaml", "x.ply"],
        ["simulate", "JOB"],
        ["demo"],
        ["model", "scan", "mesh.ply"],
        ["teach", "--reference", "x.ply", "--category", "chair"],
        ["model", "synth", "chair", "--count", "1"],
        ["model", "prepare", "meshes", "--category", "chair"],
        ["model", "boxes", "x.npz", "--category", "chair", "--count", "1"],
        ["eval", "bsrc", "--data", "x", "--category", "chair"],
        ["eval", "objects", "--data", "x"],
        ["eval", "shape", "--data", "x"],
        ["eval", "scans", "--category", "chair"],
        ["eval", "presence"],
        ["eval", "speed"],
        ["eval", "arm", "demo"],
    ],
    ids=lambda words: " ".join(words[:2]),
)
def test_every_verb_refuses_a_place_that_another_run_writes_to(job, words, capsys):
    out = job.parent / "place.ply"
    words = [str(job) if word == "JOB" else word for word in words]
    with write_lock(out):
        assert cli.run([*words, "--out", str(out)]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert f"another run is writing to {out}" in said
    assert {p.name for p in job.parent.iterdir()} == {"job"}


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_what_a_killed_demo_leaves_is_gone_after_the_next_run(tmp_path, untrained, capsys):
    command = [sys.executable, "-m", "nrdf.cli", "demo", "--no-arm", "--model", str(untrained)]
    process = subprocess.Popen([*command, "--out", str(tmp_path / "demo")])
    while process.poll() is None and not any(tmp_path.glob(".demo.*.tmp")):
        pass
    process.kill()
    process.wait()
    left = [p for p in tmp_path.iterdir() if p.name.endswith(".tmp")]
    assert len(left) == 1 and not (tmp_path / "demo").exists()
    assert cli.run(["demo", "--model", "no-such-model", "--out", str(tmp_path / "demo")]) == 2
    assert "no model" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_job_inside_out_is_refused(job, capsys):
    before = (job / "toolpaths.json").read_bytes()
    words = ["export", str(job), "--format", "csv", "--out", str(job), "--overwrite"]
    assert cli.run(words) == 2
    assert "is read, and would be overwritten" in " ".join(capsys.readouterr().err.split())
    assert (job / "toolpaths.json").read_bytes() == before


def test_a_scan_over_its_own_mesh_is_refused(tmp_path, capsys):
    (tmp_path / "mesh.ply").write_text("precious")
    assert (
        cli.run(["model", "scan", str(tmp_path / "mesh.ply"), "--out", str(tmp_path / "mesh.ply")])
        == 2
    )
    assert "is read, and would be overwritten" in " ".join(capsys.readouterr().err.split())
    assert (tmp_path / "mesh.ply").read_text() == "precious"


def test_a_scan_and_its_truth_are_as_they_were_where_writing_fails(tmp_path, monkeypatch, capsys):
    import trimesh

    trimesh.creation.box((0.5, 0.6, 0.9)).export(tmp_path / "box.ply")
    words = f"model scan {tmp_path}/box.ply --pixels 40 --out {tmp_path}/scan.ply".split()
    assert cli.run(words) == 0
    before = {p.name: p.read_bytes() for p in tmp_path.iterdir()}
    assert set(before) == {"box.ply", "scan.ply", "scan.json"}

    def full(*_):
        raise OutputError("cannot write scan.json: No space left on device")

    monkeypatch.setattr("nrdf.io.atomic.write_json", full)
    assert cli.run([*words, "--seed", "1"]) == 2
    assert {p.name: p.read_bytes() for p in tmp_path.iterdir()} == before


def test_export_replaces_only_its_own_files(job, capsys):
    assert cli.run(["export", str(job), "--format", "csv"]) == 0
    (job / "export" / "notes.txt").write_text("mine")
    (job / "export" / "csv" / "nrdf_plate.csv").write_text("edited")
    assert cli.run(["export", str(job), "--format", "apt", "--overwrite"]) == 0
    found = {p.relative_to(job / "export").as_posix() for p in (job / "export").rglob("*.*")}
    kept = {"notes.txt", "csv/nrdf_plate.csv"}
    assert found == {MANIFEST, "report.json", "apt/nrdf_plate.apt", *kept}


def test_no_cell_of_an_exported_table_is_a_formula(tmp_path):
    job = small_job()
    path = replace(job.paths[0], region="+1+2", process="-2+3", tool='=HYPERLINK("x")')
    export_job(replace(job, paths=(path,)), ["csv"], tmp_path)
    (file,) = (tmp_path / "csv").iterdir()
    lines = [line for line in file.read_text().splitlines() if not line.startswith("#")]
    rows = list(csv.DictReader(lines))
    assert rows[0]["region"] == "'+1+2" and rows[0]["process"] == "'-2+3"
    texts = {"region", "process", "tool", "kind"}
    for row in rows:
        assert not any(row[name].startswith(("=", "+", "-", "@")) for name in texts)
        # Numbers stay numbers, negative ones too.
        assert [float(row[name]) for name in ("x_m", "y_m", "z_m", "qx")]
    xs = np.concatenate([s.positions[:, 0] for s in path.segments])
    assert [float(row["x_m"]) for row in rows] == xs.tolist()


def test_a_picture_on_a_full_disk_is_an_output_error(tmp_path, monkeypatch):
    from nrdf.robot.report import pictures

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("nrdf.io.atomic.os.replace", full)
    with pytest.raises(OutputError, match="No space left on device; free some space"):
        pictures._save(tmp_path / "x.png", np.zeros((8, 8, 3), np.uint8))
    assert list(tmp_path.iterdir()) == []


def test_regions_that_would_be_one_file_are_refused(tmp_path, capsys):
    whole = cloud()
    np.savez(tmp_path / "two.npz", Seat=np.arange(9), seat=np.arange(9))
    np.savez(tmp_path / "device.npz", nul=np.arange(9))
    from nrdf.io.cloud import write_cloud

    write_cloud(tmp_path / "box.ply", whole)
    for file, message in (("two", "would be one file"), ("device", "Windows keeps nul")):
        words = f"retrieve --model chair --reference {tmp_path}/box.ply --region "
        words += f"{tmp_path}/{file}.npz --target {tmp_path}/box.ply --out {tmp_path}/out"
        assert cli.run(words.split()) == 2
        assert message in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "out").exists()


def test_a_second_studio_and_a_second_writer_of_a_data_folder_are_refused(tmp_path, capsys):
    place = str(tmp_path / "place")
    for words in (["studio", "--no-browser", "--session", place], ["model", "correspond", place]):
        with write_lock(place):
            assert cli.run(words) == 2
        assert "another run is writing to" in " ".join(capsys.readouterr().err.split())
    assert list(tmp_path.iterdir()) == []
