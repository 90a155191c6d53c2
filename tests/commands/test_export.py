"""`nrdf export`: what it replaces, and full disks as a user meets them."""

from __future__ import annotations

import csv
import errno
import json
import os
import sqlite3
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import tyro

from builders.export_jobs import small_job
from nrdf import cli
from nrdf.commands.export import export
from nrdf.errors import OutputError, ProcessError
from nrdf.export.registry import export_job
from nrdf.io.result_folder import MANIFEST
from nrdf.toolpath.file import VERSION, write_toolpaths

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


def test_a_job_inside_out_is_refused(job, capsys):
    before = (job / "toolpaths.json").read_bytes()
    words = ["export", str(job), "--format", "csv", "--out", str(job), "--overwrite"]
    assert cli.run(words) == 2
    assert "is read, and would be overwritten" in " ".join(capsys.readouterr().err.split())
    assert (job / "toolpaths.json").read_bytes() == before


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


def exported(*words: str):
    """`nrdf export` with `words`."""
    return tyro.cli(export, args=list(words), config=(tyro.conf.FlagCreatePairsOff,))


def test_verb_writes_beside_the_job_unless_told_where(tmp_path, capsys):
    write_toolpaths(tmp_path, small_job())
    exported(str(tmp_path), "--format", "csv", "krl", "--blend-mm", "0", "--process-only")
    out = tmp_path / "export"
    report = json.loads((out / "report.json").read_text())
    found = sorted(p.relative_to(out).as_posix() for p in out.rglob("*") if p.is_file())
    assert sorted([MANIFEST, *report["files"]]) == found
    assert report["formats"]["krl"] == ["krl/nrdf_plate.dat", "krl/nrdf_plate.src"]
    assert report["options"]["blend_mm"] == 0 and report["options"]["process_only"] is True
    assert "2 tool paths written to" in capsys.readouterr().out
    with pytest.raises(OutputError, match=r"not empty.*--overwrite"):
        exported(str(tmp_path), "--format", "csv")
    exported(str(tmp_path / "toolpaths.json"), "--format", "apt", "--overwrite")
    left = sorted(p.relative_to(out).as_posix() for p in out.rglob("*") if p.is_file())
    assert left == [MANIFEST, "apt/nrdf_plate.apt", "report.json"]


def test_verb_leaves_nothing_behind_where_it_fails(tmp_path):
    with pytest.raises(ProcessError, match=r"cannot read the tool paths.*toolpaths\.json"):
        exported(str(tmp_path), "--format", "csv", "--out", str(tmp_path / "out"))
    path = write_toolpaths(tmp_path, small_job())
    for words in (["--format", "csv", "krk"], ["--format", "csv", "krl", "--program", "if"]):
        with pytest.raises(ProcessError):
            exported(str(tmp_path), *words, "--out", str(tmp_path / "out"))
    path.write_text(path.read_text().replace(f'"version":{VERSION}', '"version":99'))
    with pytest.raises(ProcessError, match=f"version 99; .* reads versions up to {VERSION}:"):
        exported(str(tmp_path), "--format", "csv", "--out", str(tmp_path / "out"))
    assert list(tmp_path.iterdir()) == [path]
