"""`nrdf run`, with real workers, killed and gone on with."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time

import pytest
import yaml

from nrdf import cli
from nrdf.bundled import KNOWLEDGE, bundled_chair
from nrdf.cell.file import new_cell, write_cell
from nrdf.io.cloud import write_cloud


@pytest.fixture
def place(tmp_path):
    """cell.yaml, and in the inbox a chair, and a file that is none."""
    knowledge = yaml.safe_load(KNOWLEDGE.read_text())
    (seat,) = (region for region in knowledge["regions"] if region["name"] == "seat")
    seat["processes"] = seat["processes"][:1]
    knowledge["regions"] = [seat]
    (tmp_path / "chair.yaml").write_text(yaml.safe_dump(knowledge))
    for file in KNOWLEDGE.parent.glob("reference*"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    cell = new_cell([tmp_path / "chair.yaml"], "test", ["urscript", "json"], tmp_path)
    strict = cell.limits.model_copy(update={"strict": False})
    line = cell.line.model_copy(update={"settle_s": 0.2})
    write_cell(tmp_path / "cell.yaml", cell.model_copy(update={"limits": strict, "line": line}))
    (tmp_path / "inbox").mkdir()
    chair, _ = bundled_chair("ladder-back")
    write_cloud(tmp_path / "inbox" / "good.ply", chair)
    (tmp_path / "inbox" / "bad.ply").write_text("no cloud")
    return tmp_path


def command(place, *more):
    words = ["run", place / "cell.yaml", place / "inbox", "--out", place / "out", *more]
    code = "import sys; from nrdf import cli; sys.exit(cli.run(sys.argv[1:]))"
    return [sys.executable, "-c", code, *map(str, words)]


@pytest.mark.skipif(os.name != "posix", reason="kill -9")
def test_a_killed_run_goes_on_and_every_object_has_one_folder(place):
    first = subprocess.Popen(command(place), stdout=subprocess.DEVNULL)
    end = time.monotonic() + 240
    while not list((place / "out").glob(".work/*/target.ply")) and time.monotonic() < end:
        time.sleep(0.05)
    first.kill()
    first.wait()
    done = subprocess.run(command(place, "--once"), capture_output=True, text=True, timeout=300)
    assert done.returncode == 3, done.stderr
    said = json.loads((place / "out" / "done" / "good" / "object.json").read_text())
    assert said["figures"]["paths"] == 1
    programs = place / "out" / "done" / "good" / "programs"
    assert sorted(p.name for p in programs.iterdir()) == ["json", "urscript"]
    content = json.loads((programs / "json" / "nrdf_chair.json").read_text())
    assert content["frame"] == "base"
    assert "not a point cloud" in (place / "out" / "refused" / "bad" / "reason.txt").read_text()
    assert not list((place / "out" / "look-at").iterdir())
    assert "1 done, 0 to look at, 1 refused" in done.stdout
    assert "good" in (place / "out" / "index.html").read_text()


def test_what_cannot_run_is_said_at_once(place, capsys):
    inbox = str(place / "inbox")
    inside = ["run", str(place / "cell.yaml"), inbox, "--out", f"{inbox}/out"]
    assert cli.run(inside) == 2
    assert cli.run(["run", str(place / "cell.yaml"), str(place / "none")]) == 2
    text = (place / "cell.yaml").read_text()
    (place / "cell.yaml").write_text(text[: text.index("knowledge:  #")])
    assert cli.run(["run", str(place / "cell.yaml"), inbox, "--out", str(place / "o")]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "lies in the inbox" in said and "is no folder" in said
    assert "names no knowledge file" in said
