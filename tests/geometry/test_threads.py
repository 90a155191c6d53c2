"""The number of threads of a search."""

import os

import pytest

from nrdf.geometry.threads import search_threads


@pytest.mark.parametrize(("asked", "threads"), [("3", 3), ("4,2", 4), (" 1 ", 1)])
def test_as_many_as_are_asked_for(
    monkeypatch: pytest.MonkeyPatch, asked: str, threads: int
) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", asked)
    assert search_threads() == threads


@pytest.mark.parametrize("asked", [None, "", "0", "-2", "many"])
def test_else_as_many_as_there_are_cores(
    monkeypatch: pytest.MonkeyPatch, asked: str | None
) -> None:
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    if asked is not None:
        monkeypatch.setenv("OMP_NUM_THREADS", asked)
    assert search_threads() == os.cpu_count()
