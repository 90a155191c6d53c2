from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from nrdf.errors import OutputError
from nrdf.io.atomic import write_json
from nrdf.io.output import check_inputs, output_file, output_folder
from nrdf.io.result_folder import MANIFEST


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
    assert found == {"precious.txt", "both.ply", "new.ply", "report.json", MANIFEST}
    assert "new.ply" in (out / "both.ply").read_text()
    assert (tmp_path / "outside.txt").exists()


def test_foreign_report_is_no_reason_to_delete_or_fail(tmp_path):
    out = tmp_path / "result"
    out.mkdir()
    (out / "report.json").write_text(json.dumps(["not", "ours"]))
    with output_folder(out, overwrite=True) as folder:
        (folder / "x.txt").write_text("x")
    assert {p.name for p in out.iterdir()} == {"report.json", "x.txt", MANIFEST}


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


def test_a_full_disk_while_removing_parents_is_no_traceback(tmp_path):
    with pytest.raises(KeyboardInterrupt), output_folder(tmp_path / "a" / "b"):
        (tmp_path / "a" / "theirs.txt").write_text("put there meanwhile")
        raise KeyboardInterrupt
    assert [p.name for p in (tmp_path / "a").iterdir()] == ["theirs.txt"]


HOLD = """
import sys
from nrdf.io.output import output_folder
with output_folder(sys.argv[1], overwrite=True) as folder:
    (folder / "x.txt").write_text("first")
    print("ready", flush=True)
    sys.stdin.readline()
"""


@pytest.fixture
def other(tmp_path):
    """Another process that is writing to tmp_path/result."""
    command = [sys.executable, "-c", HOLD, str(tmp_path / "result")]
    process = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
    )
    assert process.stdout.readline() == "ready\n"
    yield process
    process.kill()
    process.communicate()


@pytest.mark.parametrize("overwrite", [False, True])
def test_a_second_run_with_the_same_out_is_refused_at_once(tmp_path, other, overwrite):
    with (
        pytest.raises(OutputError, match=r"another run is writing to .*result"),
        output_folder(tmp_path / "result", overwrite),
    ):
        pytest.fail("the block must not run")
    other.communicate("\n", timeout=30)
    assert other.returncode == 0
    assert [p.name for p in tmp_path.iterdir()] == ["result"]
    assert (tmp_path / "result" / "x.txt").read_text() == "first"


def test_the_same_place_by_a_link_is_the_same_place(tmp_path, other):
    (tmp_path / "link").symlink_to("result")
    with (
        pytest.raises(OutputError, match="another run is writing"),
        output_folder(tmp_path / "link", True),
    ):
        pytest.fail("the block must not run")


def test_what_a_killed_run_left_is_cleared_by_the_next_and_not_by_one_beside(tmp_path, other):
    other.kill()
    other.wait()
    left = {p.name for p in tmp_path.iterdir()}
    assert len(left) == 2 and ".result.lock" in left
    with output_folder(tmp_path / "neighbour"):
        pass
    assert {p.name for p in tmp_path.iterdir()} == left | {"neighbour"}
    with output_folder(tmp_path / "result"):
        pass
    assert {p.name for p in tmp_path.iterdir()} == {"neighbour", "result"}


def test_a_link_is_followed_and_said_and_stays(tmp_path, caplog):
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to("real")
    with caplog.at_level("INFO"), output_folder(tmp_path / "link") as folder:
        (folder / "x.txt").write_text("x")
    assert f"the results go to {tmp_path / 'real'}" in caplog.text
    assert (tmp_path / "link").is_symlink() and (tmp_path / "real" / "x.txt").exists()
    (tmp_path / "loop").symlink_to("loop")
    with pytest.raises(OutputError, match="loop"), output_folder(tmp_path / "loop"):
        pytest.fail("the block must not run")


@pytest.mark.parametrize("name", ["target.ply", "deep/target.ply", "link.ply", "../link.ply", "."])
def test_an_input_inside_is_refused_before_anything_runs(tmp_path, name):
    out = tmp_path / "result"
    (out / "deep").mkdir(parents=True)
    (out / "target.ply").write_text("precious")
    (out / "deep" / "target.ply").write_text("precious")
    (tmp_path / "elsewhere.ply").write_text("precious")
    (out / "link.ply").symlink_to(tmp_path / "elsewhere.ply")  # named inside, lies outside
    (tmp_path / "link.ply").symlink_to(out / "target.ply")  # named outside, lies inside
    with (
        pytest.raises(
            OutputError, match=r"is read, and would be overwritten .* give another --out"
        ),
        output_folder(out, overwrite=True, inputs=[None, "no-such-model", out / name]),
    ):
        pytest.fail("the block must not run")
    assert (out / "target.ply").read_text() == "precious"


def test_an_input_beside_or_around_is_no_hindrance(tmp_path):
    job = tmp_path / "job"
    job.mkdir()
    (job / "toolpaths.json").write_text("{}")
    with output_folder(job / "export", inputs=[job, job / "toolpaths.json"]):
        pass
    with output_folder(job / "export", overwrite=True, inputs=[job]):
        pass
    check_inputs(job / "new.json", [job / "toolpaths.json"])
    with pytest.raises(OutputError, match="is read"):
        check_inputs(job / "toolpaths.json", [job / "export" / ".." / "toolpaths.json"])


def test_a_file_is_claimed_before_anything_is_computed(tmp_path):
    with output_file(tmp_path / "new" / "x.json"):
        write_json(tmp_path / "new" / "x.json", {"ä": 1})
        with (
            pytest.raises(OutputError, match="another run"),
            output_file(tmp_path / "new" / "x.json"),
        ):
            pytest.fail("the block must not run")
    assert [p.name for p in (tmp_path / "new").iterdir()] == ["x.json"]
    for place, message in (("new", "is a folder"), ("new/x.json/y.json", "cannot write")):
        with pytest.raises(OutputError, match=message), output_file(tmp_path / place):
            pytest.fail("the block must not run")


@pytest.mark.skipif(not hasattr(os, "fork"), reason="kills forked processes")
@pytest.mark.parametrize("more", [[], ["inside"]], ids=["renamed", "file by file"])
def test_killed_anywhere_leaves_the_old_or_the_new_and_the_next_run_is_clean(tmp_path, more):
    """`kill -9` before every single change on disk; what is checked stands in kill_points.py."""
    script = Path(__file__).parents[1] / "builders" / "kill_points.py"
    done = subprocess.run(
        [sys.executable, script, tmp_path / "here", *more], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 15
