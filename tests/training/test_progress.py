"""What a person and a file see of a run."""

from __future__ import annotations

import json
import logging

import pytest

from nrdf.errors import OutputError
from nrdf.training.progress import Display


@pytest.fixture(autouse=True)
def no_tensorboard(monkeypatch):
    monkeypatch.setattr("nrdf.training.progress._tensorboard", lambda folder, step: None)


def test_without_a_terminal_there_are_lines_with_loss_rate_and_time(tmp_path, caplog):
    caplog.set_level(logging.INFO)
    with Display(tmp_path, total=100, done=40) as display:
        display.report("shape", 50, {"loss/total": 0.25, "rate": 1e-3})
    assert "shape 50/100  total 0.25  rate 0.001" in caplog.text and "s left" in caplog.text
    (line,) = (tmp_path / "metrics.jsonl").read_text().splitlines()
    assert json.loads(line) == {"step": 50, "stage": "shape", "loss/total": 0.25, "rate": 1e-3}


def test_the_other_processes_are_silent(tmp_path, caplog):
    caplog.set_level(logging.INFO)
    with Display(tmp_path, total=10, done=0, active=False) as display:
        display.report("shape", 5, {"loss/total": 0.25})
    assert not caplog.text and not list(tmp_path.iterdir())


def test_a_file_that_cannot_be_written_is_an_output_error(tmp_path):
    (tmp_path / "metrics.jsonl").mkdir()
    with pytest.raises(OutputError, match="it goes on from its last checkpoint"):
        Display(tmp_path, total=10, done=0)


def test_tensorboard_gets_the_scalars(tmp_path, monkeypatch):
    scalars = []

    class Board:
        def add_scalar(self, *args):
            scalars.append(args)

        def close(self):
            scalars.append("closed")

    monkeypatch.setattr("nrdf.training.progress._tensorboard", lambda folder, step: Board())
    with Display(tmp_path, total=10, done=0) as display:
        display.report("shape", 5, {"loss/total": 0.25})
    assert scalars == [("loss/total", 0.25, 5), "closed"]
