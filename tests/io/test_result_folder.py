"""An earlier result is replaced; nothing that nrdf did not write is ever lost."""

from __future__ import annotations

import hashlib
import json
import os

import pytest

from nrdf.errors import OutputError
from nrdf.io import locks, result_folder
from nrdf.io.output import output_folder
from nrdf.io.result_folder import MANIFEST


@pytest.fixture(params=["renamed", "file by file"])
def out(request, tmp_path, monkeypatch):
    """The folder of a result: one that can be moved, and one that cannot, like a mount point."""
    place = tmp_path / "result"
    place.mkdir()
    if request.param == "file by file":
        ismount = os.path.ismount
        monkeypatch.setattr(locks.os.path, "ismount", lambda p: p == place or ismount(p))
    return place


def write(out, files):
    with output_folder(out, overwrite=True) as folder:
        for name, text in files.items():
            (folder / name).parent.mkdir(exist_ok=True)
            (folder / name).write_text(text)


def texts(out):
    files = {p.relative_to(out).as_posix(): p for p in out.rglob("*") if p.is_file()}
    return {name: path.read_text() for name, path in files.items() if name != MANIFEST}


def test_a_result_replaces_an_earlier_one_without_a_report(out):
    write(out, {"a.csv": "1", "sub/b.csv": "1", "gone/c.csv": "1"})
    write(out, {"a.csv": "2", "sub/d.csv": "2"})
    assert texts(out) == {"a.csv": "2", "sub/d.csv": "2"}
    assert not (out / "gone").exists()
    assert {p.name for p in out.iterdir()} == {"a.csv", "sub", MANIFEST}
    assert [p.name for p in out.parent.iterdir()] == ["result"]


def test_a_planted_report_deletes_nothing(out):
    (out / "mine.txt").write_text("mine")
    (out / "sub").mkdir()
    (out / "sub" / "mine.txt").write_text("mine")
    (out / "report.json").write_text(json.dumps({"files": ["mine.txt", "sub/mine.txt"]}))
    write(out, {"a.csv": "1"})
    assert {"mine.txt", "sub/mine.txt", "report.json", "a.csv"} == set(texts(out))


def test_a_planted_manifest_deletes_nothing_outside_behind_links_or_changed(out):
    outside = out.parent / "outside"
    outside.mkdir()
    (outside / "x.txt").write_text("x")
    (out / "link").symlink_to(outside)
    (out / "x.txt").symlink_to(outside / "x.txt")
    (out / "changed.txt").write_text("y")
    digest = hashlib.sha256(b"x").hexdigest()
    names = ("../outside/x.txt", "link/x.txt", "x.txt", "changed.txt", str(outside / "x.txt"))
    rows = [{"name": name, "bytes": 1, "sha256": digest} for name in names]
    (out / MANIFEST).write_text(json.dumps({"files": rows}))
    write(out, {"a.csv": "1"})
    assert (outside / "x.txt").read_text() == "x"
    assert (out / "link").is_symlink() and (out / "x.txt").is_symlink()
    assert (out / "changed.txt").read_text() == "y" and (out / "a.csv").exists()


@pytest.mark.parametrize(
    "text", ["", "[]", "[" * 100_000, '{"files": [1]}', '{"files": [{"name": "a"}]}', "\0",
             '{"files": [{"name": "a.csv", "bytes": 1e999, "sha256": ""}]}'],
)  # fmt: skip
def test_a_damaged_manifest_makes_nothing_ours(out, text):
    (out / "a.csv").write_text("mine")
    (out / MANIFEST).write_text(text)
    write(out, {"a.csv": "1"})
    assert texts(out) == {"a.csv": "1", "a.csv.kept": "mine"}


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes")
def test_a_pipe_for_a_manifest_keeps_nobody_waiting(out):
    os.mkfifo(out / MANIFEST)
    write(out, {"a.csv": "1"})
    write(out, {"a.csv": "2"})
    assert texts(out)["a.csv"] == "2" and (out / MANIFEST).is_file()


def test_what_somebody_changed_is_kept_beside_and_said(out, caplog):
    write(out, {"chair.yaml": "written", "sub/b.csv": "1", "report.json": "1"})
    for edit in ("edited once", "edited again"):
        (out / "chair.yaml").write_text(edit)
        write(out, {"chair.yaml": "written", "sub/b.csv": "2", "report.json": "2"})
    kept = {"chair.yaml.kept": "edited once", "chair.yaml.kept-2": "edited again"}
    assert texts(out) == {"chair.yaml": "written", "sub/b.csv": "2", "report.json": "2", **kept}
    assert "it is kept as chair.yaml.kept" in caplog.text


def test_links_and_folders_where_a_file_comes_are_set_aside(out):
    outside = out.parent / "outside"
    outside.mkdir()
    (outside / "b.csv").write_text("theirs")
    (out / "sub").symlink_to(outside)
    (out / "a.csv").mkdir()
    (out / "a.csv" / "note.txt").write_text("mine")
    write(out, {"a.csv": "1", "sub/b.csv": "1"})
    assert (outside / "b.csv").read_text() == "theirs"
    assert (out / "a.csv").read_text() == "1" and (out / "a.csv.kept/note.txt").exists()
    assert (out / "sub.kept").is_symlink() and (out / "sub/b.csv").read_text() == "1"
    write(out, {"sub": "1"})
    assert (out / "sub").read_text() == "1"


def test_notes_in_a_folder_that_becomes_a_file_are_kept(out):
    write(out, {"x/a.csv": "1"})
    (out / "x" / "note.txt").write_text("mine")
    write(out, {"x": "2"})
    assert texts(out) == {"x": "2", "x.kept/note.txt": "mine"}


def test_folders_that_are_empty_are_part_of_a_result(out):
    for _ in range(2):
        with output_folder(out, overwrite=True) as folder:
            (folder / "regions").mkdir()
        assert (out / "regions").is_dir()


def test_the_folders_rights_stay(out):
    out.chmod(0o750)
    write(out, {"a.csv": "1"})
    assert out.stat().st_mode & 0o777 == 0o750


def test_where_renaming_fails_in_the_middle_the_old_result_is_back(tmp_path, monkeypatch):
    write(tmp_path / "result", {"a.csv": "1"})
    rename = os.rename

    def fails(source, target):
        if str(source).endswith(".tmp"):
            raise PermissionError(13, "Permission denied")
        rename(source, target)

    monkeypatch.setattr(result_folder.os, "rename", fails)
    with pytest.raises(OutputError, match="Permission denied; allow writing"):
        write(tmp_path / "result", {"a.csv": "2"})
    assert texts(tmp_path / "result") == {"a.csv": "1"}
    assert [p.name for p in tmp_path.iterdir()] == ["result"]


def test_a_folder_that_is_in_use_gets_the_files_one_by_one(tmp_path, monkeypatch):
    write(tmp_path / "result", {"a.csv": "1", "b.csv": "1"})
    rename = os.rename

    def in_use(source, target):
        if source == tmp_path / "result":
            raise PermissionError(13, "Permission denied")
        rename(source, target)

    monkeypatch.setattr(result_folder.os, "rename", in_use)
    write(tmp_path / "result", {"a.csv": "2"})
    assert texts(tmp_path / "result") == {"a.csv": "2"}


def test_the_folder_that_one_stands_in_stays(tmp_path, monkeypatch):
    (tmp_path / "result").mkdir()
    monkeypatch.chdir(tmp_path / "result")
    before = os.stat(".").st_ino
    write(".", {"a.csv": "1"})
    assert os.stat(tmp_path / "result").st_ino == before
    assert texts(tmp_path / "result") == {"a.csv": "1"}


def test_a_mount_point_without_a_writable_parent_is_written(tmp_path, monkeypatch):
    (tmp_path / "out").mkdir()
    access = os.access
    monkeypatch.setattr(locks.os, "access", lambda p, mode: p != tmp_path and access(p, mode))
    with output_folder(tmp_path / "out") as folder:
        assert folder.parent == tmp_path / "out"
        (folder / "a.csv").write_text("1")
    assert texts(tmp_path / "out") == {"a.csv": "1"}
    assert {p.name for p in (tmp_path / "out").iterdir()} == {"a.csv", MANIFEST}
