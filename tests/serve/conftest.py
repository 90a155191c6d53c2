"""Fixtures of the line's tests."""

from __future__ import annotations

import time

import pytest

from builders.line_process import environment, line_in


@pytest.fixture
def start(tmp_path, monkeypatch):
    """Lines in tmp_path, whose workers obey the objects' text; ended with the test."""
    monkeypatch.setenv("PYTHONPATH", environment()["PYTHONPATH"])
    started = []

    def make(**given):
        inbox = tmp_path / "inbox"
        inbox.mkdir(exist_ok=True)
        line = line_in(tmp_path / "out", inbox, **given)
        started.append(line)
        line.recover()
        return line

    yield make
    for line in started:
        line.pool.__exit__()
        line.store.close()


@pytest.fixture
def finish():
    """Steps a line until it is idle."""

    def run(line, seconds=40.0):
        end = time.monotonic() + seconds
        line.step()
        while True:
            time.sleep(0.06)
            line.step()
            if line.idle:
                return {row.name: row for row in line.store.rows()}
            assert time.monotonic() < end, line.store.rows()

    return run
