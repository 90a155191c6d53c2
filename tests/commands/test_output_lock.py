"""Places that can only be read, or that another run writes to, are refused by every verb."""

from __future__ import annotations

import pytest

from builders.export_jobs import small_job
from nrdf import cli
from nrdf.io.locks import write_lock
from nrdf.toolpath.file import write_toolpaths


@pytest.fixture
def job(tmp_path):
    (tmp_path / "job").mkdir()
    write_toolpaths(tmp_path / "job", small_job())
    return tmp_path / "job"


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


def test_a_second_studio_and_a_second_writer_of_a_data_folder_are_refused(tmp_path, capsys):
    place = str(tmp_path / "place")
    for words in (["studio", "--no-browser", "--session", place], ["model", "correspond", place]):
        with write_lock(place):
            assert cli.run(words) == 2
        assert "another run is writing to" in " ".join(capsys.readouterr().err.split())
    assert list(tmp_path.iterdir()) == []
