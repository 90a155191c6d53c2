"""`nrdf demo`: what it writes, and what an interrupted one leaves."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from nrdf import cli
from nrdf.bundled import REAL, bundled_chair, bundled_mesh
from nrdf.commands.demo_new_kind import NewKind
from nrdf.io.cloud import read_cloud
from nrdf.io.result_folder import MANIFEST
from nrdf.process.bound_knowledge import read_bound_knowledge
from nrdf.process.transfer_result import MIN_CONFIDENCE
from nrdf.reports.job_meshes import read_job_meshes


def test_demo_compares_with_the_truth_and_ends_with_programs(untrained, tmp_path, monkeypatch):
    monkeypatch.setattr("nrdf.bundled.TARGETS", ("rocker",))
    shown = NewKind("a table has no model", 0.9, None, 1.0)  # has a test of its own
    monkeypatch.setattr("nrdf.commands.demo.transfer_new_kind", lambda *_: shown)
    out = tmp_path / "demo"
    assert cli.run(["demo", "--no-arm", "--model", str(untrained), "--out", str(out)]) == 0
    report = json.loads((out / "report.json").read_text())
    found = {str(p.relative_to(out)) for p in out.rglob("*") if p.is_file()}
    assert found == {MANIFEST, *report["files"]}
    real = [row for row in report["found"] if row["chair"] == REAL]
    rows = [row for row in report["found"] if row["chair"] == "rocker"]
    assert len(real) == len(rows) == 5 and real[0]["true"] is real[0]["iou"] is None
    # The scan lies as it was scanned; the job says how the chair stands in it.
    job = json.loads((out / REAL / "toolpaths.json").read_text())
    np.testing.assert_allclose(job["pose"]["up"], [0, 0, 1], atol=0.02)
    # Paths are planned on the scan, and compared with the mesh that was scanned.
    surface = read_job_meshes(out / REAL).surface
    assert len(surface.faces) > 10 * len(bundled_mesh().faces)
    off = [r["true_distance_99_m"] for r in real if r["true_distance_99_m"] is not None]
    assert len(off) and 1e-4 < max(off) < 0.05
    for row in rows:
        _, truth = bundled_chair(row["chair"])
        assert row["true"] == int(truth[row["region"]].sum())
        assert 0 <= row["iou"] <= 1
        if row["coverage"] is not None:
            found = read_cloud(out / row["chair"] / "regions" / f"{row['region']}.ply")
            assert len(found) == row["found"]
            assert 0.5 < row["coverage"] <= 1 and row["cycle_time_s"] > 0
        else:
            assert row["found"] == 0 or row["confidence"] < MIN_CONFIDENCE
    assert max(row["iou"] for row in rows) > 0.3
    assert sum(row["coverage"] is not None for row in rows) >= 3
    assert (out / "picture.png").stat().st_size > 50_000
    assert (out / "rocker" / "report.html").exists()
    assert list((out / "rocker" / "export" / "urscript").iterdir())
    # What the demo suggests to try next works.
    result = tmp_path / "result"
    words = f"retrieve --model {untrained} --reference {out}/reference.ply --region "
    words += f"{out}/reference/seat.ply --target {out}/rocker.ply --out {result}"
    assert cli.run(words.split()) == 0
    seat = next(row for row in rows if (row["chair"], row["region"]) == ("rocker", "seat"))
    again = json.loads((result / "report.json").read_text())["regions"]["seat"]
    assert again["points"] == seat["found"]
    taught, _ = bundled_chair("reference")
    lesson = read_bound_knowledge(out / "chair.yaml")
    np.testing.assert_allclose(lesson.cloud.points, taught.points, atol=1e-6)


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_a_real_ctrl_c_ends_with_130_and_leaves_nothing(untrained, tmp_path):
    command = [sys.executable, "-m", "nrdf.cli", "demo", "--no-arm", "--model", str(untrained)]
    process = subprocess.Popen(
        [*command, "--out", str(tmp_path / "demo")],
        stderr=subprocess.PIPE,
        text=True,
        # Started from a background job, the tests inherit an ignored SIGINT.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    deadline = time.monotonic() + 60
    while not any(tmp_path.glob(".demo.*/*.ply")) and time.monotonic() < deadline:
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    said = process.communicate(timeout=60)[1]
    assert (process.returncode, "Traceback" in said) == (130, False)
    assert list(tmp_path.iterdir()) == []


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
