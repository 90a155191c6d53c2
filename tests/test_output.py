from __future__ import annotations

import json

import pytest

from nrdf.errors import OutputError
from nrdf.output import output_folder, write_json


def test_folder_appears_only_when_the_block_ends_well(tmp_path):
    out = tmp_path / "a" / "b" / "result"
    with output_folder(out) as folder:
        (folder / "x.txt").write_text("x")
        (folder / "sub").mkdir()
        (folder / "sub" / "y.txt").write_text("y")
        assert not out.exists()
    assert (out / "x.txt").read_text() == "x"
    assert (out / "sub" / "y.txt").read_text() == "y"
    assert [p.name for p in out.parent.iterdir()] == ["result"]


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError])
def test_nothing_stays_behind_after_an_error(tmp_path, error):
    with pytest.raises(error), output_folder(tmp_path / "a" / "result") as folder:
        (folder / "half.txt").write_text("half")
        raise error
    assert list(tmp_path.iterdir()) == []


def test_existing_parents_stay_after_an_error(tmp_path):
    (tmp_path / "a").mkdir()
    with pytest.raises(KeyboardInterrupt), output_folder(tmp_path / "a" / "b" / "result"):
        raise KeyboardInterrupt
    assert list(tmp_path.iterdir()) == [tmp_path / "a"]
    assert list((tmp_path / "a").iterdir()) == []


def test_empty_folder_is_used_and_a_full_one_refused(tmp_path):
    with output_folder(tmp_path / "result") as folder:
        (folder / "x.txt").write_text("1")
    (tmp_path / "empty").mkdir()
    with output_folder(tmp_path / "empty") as folder:
        (folder / "x.txt").write_text("1")
    assert (tmp_path / "empty" / "x.txt").exists()
    with (
        pytest.raises(OutputError, match=r"not empty.*--overwrite"),
        output_folder(tmp_path / "result"),
    ):
        pytest.fail("the block must not run")


def test_overwrite_replaces_its_own_files_and_leaves_others(tmp_path):
    out = tmp_path / "result"
    out.mkdir()
    (out / "precious.txt").write_text("keep")
    (tmp_path / "outside.txt").write_text("keep")
    for names in (["old.ply", "both.ply"], ["both.ply", "new.ply"]):
        with output_folder(out, overwrite=True) as folder:
            for name in names:
                (folder / name).write_text(str(names))
            listed = [*names, "report.json", "../outside.txt"]
            write_json(folder / "report.json", {"files": listed})
    found = {p.name for p in out.iterdir()}
    assert found == {"precious.txt", "both.ply", "new.ply", "report.json"}
    assert "new.ply" in (out / "both.ply").read_text()
    assert (tmp_path / "outside.txt").exists()


def test_foreign_report_is_no_reason_to_delete_or_fail(tmp_path):
    out = tmp_path / "result"
    out.mkdir()
    (out / "report.json").write_text(json.dumps(["not", "ours"]))
    with output_folder(out, overwrite=True) as folder:
        (folder / "x.txt").write_text("x")
    assert {p.name for p in out.iterdir()} == {"report.json", "x.txt"}


def test_unwritable_place_is_an_output_error_with_the_path(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="is a file"), output_folder(tmp_path / "file"):
        pass
    with pytest.raises(OutputError, match="file/result"), output_folder(tmp_path / "file/result"):
        pass


def test_full_disk_is_an_output_error_and_leaves_nothing(tmp_path):
    with pytest.raises(OutputError, match="No space left"), output_folder(tmp_path / "result"):
        raise OSError(28, "No space left on device")
    assert list(tmp_path.iterdir()) == []
