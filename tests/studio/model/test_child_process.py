"""A child process: results, refusals, faults, cancelling, and its own end."""

from __future__ import annotations

import os

import pytest

from builders.studio_page import silent
from nrdf.errors import NrdfError, ProcessError
from nrdf.studio.model.child_process import ChildProcess, answer, progress_of
from nrdf.studio.model.worker import Cancelled


def serve(pipe, factor):
    """In the child process: do what each request says."""
    while True:
        request = pipe.recv()
        if request is not None:
            answer(pipe, lambda request=request: work(pipe, factor, request))


def work(pipe, factor, request):
    if request == "refuse":
        raise ProcessError("feed_m_s: must be above 0")
    if request == "fail":
        raise RuntimeError("oh")
    if request == "end":
        os._exit(3)
    if request == "wait":
        progress = progress_of(pipe)
        while True:
            progress(1, 2)
    return factor * request


def test_one_process_answers_refuses_fails_cancels_and_ends():
    """One process for all of it: starting one takes a second."""
    child = ChildProcess(serve, (7,), lambda why: NrdfError(f"ended: {why}"))
    assert child.request(6, silent) == 42
    with pytest.raises(ProcessError, match="feed_m_s"):
        child.request("refuse", silent)
    with pytest.raises(RuntimeError, match="RuntimeError: oh"):
        child.request("fail", silent)
    seen = []

    def cancel(done, total):
        seen.append((done, total))
        if done:
            raise Cancelled

    with pytest.raises(Cancelled):
        child.request("wait", cancel)
    assert seen[-1] == (1, 2)
    assert child.alive and child.request(2, silent) == 14, "it goes on after a cancelled request"
    with pytest.raises(NrdfError, match="ended: code 3"):
        child.request("end", silent)
    assert not child.alive
    child.end()
