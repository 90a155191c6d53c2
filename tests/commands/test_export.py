from __future__ import annotations

import json

import pytest
import tyro

from builders.export_jobs import small_job
from nrdf.commands.export import export
from nrdf.errors import OutputError, ProcessError
from nrdf.io.result_folder import MANIFEST
from nrdf.toolpath.file import write_toolpaths


def run(*words: str):
    """`nrdf export` with `words`."""
    return tyro.cli(export, args=list(words), config=(tyro.conf.FlagCreatePairsOff,))


def test_verb_writes_beside_the_job_unless_told_where(tmp_path, capsys):
    write_toolpaths(tmp_path, small_job())
    run(str(tmp_path), "--format", "csv", "krl", "--blend-mm", "0", "--process-only")
    out = tmp_path / "export"
    report = json.loads((out / "report.json").read_text())
    found = sorted(p.relative_to(out).as_posix() for p in out.rglob("*") if p.is_file())
    assert sorted([MANIFEST, *report["files"]]) == found
    assert report["formats"]["krl"] == ["krl/nrdf_plate.dat", "krl/nrdf_plate.src"]
    assert report["options"]["blend_mm"] == 0 and report["options"]["process_only"] is True
    assert "2 tool paths written to" in capsys.readouterr().out
    with pytest.raises(OutputError, match=r"not empty.*--overwrite"):
        run(str(tmp_path), "--format", "csv")
    run(str(tmp_path / "toolpaths.json"), "--format", "apt", "--overwrite")
    left = sorted(p.relative_to(out).as_posix() for p in out.rglob("*") if p.is_file())
    assert left == [MANIFEST, "apt/nrdf_plate.apt", "report.json"]


def test_verb_leaves_nothing_behind_where_it_fails(tmp_path):
    with pytest.raises(ProcessError, match=r"cannot read the tool paths.*toolpaths\.json"):
        run(str(tmp_path), "--format", "csv", "--out", str(tmp_path / "out"))
    path = write_toolpaths(tmp_path, small_job())
    for words in (["--format", "csv", "krk"], ["--format", "csv", "krl", "--program", "if"]):
        with pytest.raises(ProcessError):
            run(str(tmp_path), *words, "--out", str(tmp_path / "out"))
    path.write_text(path.read_text().replace('"version":3', '"version":99'))
    with pytest.raises(ProcessError, match="version 99; this nrdf reads versions up to 3"):
        run(str(tmp_path), "--format", "csv", "--out", str(tmp_path / "out"))
    assert list(tmp_path.iterdir()) == [path]
