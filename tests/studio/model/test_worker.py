"""Work in the background: progress, cancelling, the newest of its kind, faults."""

from __future__ import annotations

import threading

import pytest

from nrdf.errors import ProcessError
from nrdf.studio.model.worker import Worker


class Log:
    """What a worker says, and a worker that says it."""

    def __init__(self):
        self.lines = []
        self.worker = Worker(
            lambda what: self.lines.append(what),
            lambda done, total: self.lines.append((done, total)),
            lambda what, error: self.lines.append((what, error)),
        )


@pytest.fixture
def log():
    made = Log()
    yield made
    made.worker.stop()


def test_progress_and_end_are_reported(log):
    log.worker.submit("plan", "planning", lambda progress: progress(1, 2))
    assert log.worker.wait(5)
    until_logged(log, ("planning", ""))
    assert log.lines == ["planning", (1, 2), ("planning", "")]


def test_cancelling_stops_at_the_next_step(log):
    begun, go_on = threading.Event(), threading.Event()

    def work(progress):
        begun.set()
        go_on.wait(5)
        progress(1, 2)
        log.lines.append("not reached")

    log.worker.submit("transfer", "transfer", work)
    begun.wait(5)
    log.worker.submit("plan", "planning", lambda progress: log.lines.append("waiting work"))
    log.worker.cancel()
    go_on.set()
    assert log.worker.wait(5)
    until_logged(log, ("transfer", "cancelled"))
    assert "not reached" not in log.lines and "waiting work" not in log.lines


def test_the_newest_of_a_kind_replaces_what_waits_and_runs(log):
    begun, go_on = threading.Event(), threading.Event()

    def slow(progress):
        begun.set()
        go_on.wait(5)
        progress(0, 1)
        log.lines.append("old")

    log.worker.submit("plan", "first", slow)
    begun.wait(5)
    for name in ("second", "third"):
        log.worker.submit("plan", name, lambda progress, name=name: log.lines.append(name))
    go_on.set()
    assert log.worker.wait(5)
    until_logged(log, ("third", ""))
    assert "old" not in log.lines and "second" not in log.lines and "third" in log.lines


def test_what_does_not_replace_lets_run_what_has_begun_and_keeps_the_newest(log):
    begun, go_on = threading.Event(), threading.Event()

    def slow(progress):
        begun.set()
        go_on.wait(5)
        progress(0, 1)
        log.lines.append("old")

    log.worker.submit("look", "first", slow, replaces=False)
    begun.wait(5)
    for name in ("second", "third"):
        work = lambda progress, name=name: log.lines.append(name)  # noqa: E731
        log.worker.submit("look", name, work, replaces=False)
    go_on.set()
    assert log.worker.wait(5)
    until_logged(log, ("third", ""))
    assert "old" in log.lines and "second" not in log.lines and "third" in log.lines


def test_a_delayed_job_that_is_replaced_never_begins(log):
    log.worker.submit("plan", "first", lambda progress: log.lines.append("ran"), delay_s=30.0)
    log.worker.submit("plan", "second", lambda progress: log.lines.append("second ran"))
    assert log.worker.wait(5)
    assert "ran" not in log.lines and "first" not in log.lines and "second ran" in log.lines


def test_faults_are_reported_and_the_worker_goes_on(log, caplog):
    def refused(progress):
        raise ProcessError("feed_m_s: must be above 0")

    def broken(progress):
        raise RuntimeError("oh")

    log.worker.submit("a", "refused", refused)
    log.worker.submit("b", "broken", broken)
    log.worker.submit("c", "fine", lambda progress: None)
    assert log.worker.wait(5)
    until_logged(log, ("fine", ""))
    assert ("refused", "feed_m_s: must be above 0") in log.lines
    assert any("RuntimeError: oh" in str(line) for line in log.lines)


def until_logged(log, line):
    """`wait` may end just before the end is reported."""
    for _ in range(500):
        if line in log.lines:
            return
        threading.Event().wait(0.01)
    raise AssertionError(f"{line} was not reported: {log.lines}")
