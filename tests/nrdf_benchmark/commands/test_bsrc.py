"""`nrdf eval bsrc` as a user runs it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time

import pytest

from builders.bsrc_folder import member_clouds, write_bsrc
from nrdf import cli
from nrdf.errors import NrdfError


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    clouds = member_clouds("chair", (0, 1, 2))
    return write_bsrc(tmp_path_factory.mktemp("bsrc"), "chair", clouds)


def said(capsys):
    return " ".join(capsys.readouterr().err.split())


def test_the_table_is_printed_and_everything_written(root, untrained, tmp_path, capsys):
    out = tmp_path / "new" / "results"
    words = f"eval bsrc --data {root}/ --category chair --method nrdf copy box "
    words += f"--model {untrained} --out {out}/ --workers 1"
    assert cli.run(words.split()) == 0
    shown = capsys.readouterr().out.splitlines()
    assert shown[0].startswith("CD-L1: objects 1, 2, 3 of chair, 6 ordered pairs")
    rows = [line.split() for line in shown if line.startswith(("nrdf", "copy", "box"))]
    assert [row[0] for row in rows] == ["nrdf", "copy", "box"]
    assert all(len(row) == 1 + 8 + 2 for row in rows)
    assert any(line.startswith("published NRDF") and "0.039" in line for line in shown)
    assert shown[-2].startswith("confidence of nrdf: mean CD-L1 0.")
    assert max(map(len, shown[:-3])) <= 80
    stem = "table2-chair-published"
    assert sorted(path.name for path in out.iterdir()) == [
        "figure-chair.png", "pairs", f"{stem}.csv", f"{stem}.json", f"{stem}.md",
    ]  # fmt: skip
    content = json.loads((out / f"{stem}.json").read_text())
    assert content["workers"] == 1 and content["cores"] == os.cpu_count()
    assert {"python", "numpy", "nrdf"} <= set(content["versions"]) and "commit" in content
    assert content["methods"]["nrdf"]["weights"] == untrained.name
    assert len(content["methods"]["nrdf"]["weights_sha256"]) == 64
    # Again: nothing is computed, the files are the same but for what says when and how.
    assert cli.run(words.split()) == 0
    again = capsys.readouterr()
    assert "nrdf: 6 of 6 pairs were there already" in again.err
    assert again.out.splitlines() == shown
    assert json.loads((out / f"{stem}.json").read_text())["methods"] == content["methods"]
    assert cli.run([*words.split(), "--overwrite"]) == 0
    assert "were there already" not in capsys.readouterr().err


def test_another_metric_is_printed_without_published_rows(root, capsys):
    words = f"eval bsrc --data {root} --category chair --method copy --workers 1 --metric iou"
    assert cli.run(words.split()) == 0
    shown = capsys.readouterr().out
    assert shown.startswith("IoU: objects 1, 2, 3") and "published" not in shown.splitlines()[-1]
    assert "published NRDF" not in shown and "higher is better" in shown


@pytest.mark.parametrize(
    "words, message",
    [
        ("--data nowhere --method copy", "there is no folder nowhere; expected folders"),
        ("--method copi", "no method 'copi'; known: copy, box"),
        ("--method copy --metric cd", "no metric 'cd'; known: cd-l1"),
        ("--method imdc --runs none", "expected none/chair-imdc/weights.safetensors"),
        ("--method nrdf --model car", "needs weights of category 'chair'"),
    ],
)
def test_bad_input_is_named_before_anything_is_written(root, tmp_path, capsys, words, message):
    out = tmp_path / "results"
    data = [] if "--data" in words else ["--data", str(root)]
    given = ["eval", "bsrc", "--category", "chair", "--out", str(out), *data, *words.split()]
    assert cli.run(given) == NrdfError.exit_code
    assert message in said(capsys)
    assert not out.exists()


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_ctrl_c_ends_with_130_and_the_same_command_goes_on(root, tmp_path, capsys):
    out = tmp_path / "results"
    words = f"eval bsrc --data {root} --category chair --method registration --workers 2 "
    words += f"--out {out}"
    process = subprocess.Popen(
        [sys.executable, "-m", "nrdf.cli", *words.split()],
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
        # Started from a background job, the tests inherit an ignored SIGINT.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    pairs = out / "pairs" / "chair-published-registration.jsonl"
    deadline = time.monotonic() + 60
    while not (pairs.exists() and pairs.read_text()) and time.monotonic() < deadline:
        time.sleep(0.005)
    process.send_signal(signal.SIGINT)
    message = process.communicate(timeout=60)[1]
    assert process.returncode == 130 and "Traceback" not in message
    assert "interrupted; the same command goes on where it was" in message
    assert [path.name for path in out.iterdir()] == ["pairs"]
    assert cli.run([*words.split(), "--workers", "1"]) == 0
    assert "of 6 pairs were there already" in said(capsys)
    assert len(pairs.read_text().splitlines()) == 6


def test_an_interrupt_without_a_folder_promises_nothing(root, monkeypatch, capsys):
    def interrupted(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr("nrdf_benchmark.bsrc.dataset.read_bsrc", interrupted)
    words = f"eval bsrc --data {root} --category chair --method copy"
    assert cli.run(words.split()) == 130
    assert said(capsys) == "nrdf: interrupted"
