"""What lies over the objects: what it shows, and what it is asked to do."""

from __future__ import annotations

import html
import json
from types import SimpleNamespace

import pytest


@pytest.fixture
def asks(page, monkeypatch):
    """Asks as the page of browser 7 does."""
    answers = page.server.page.answers
    client = SimpleNamespace(client_id=7)
    monkeypatch.setattr(page.server, "get_clients", lambda: {7: client})
    return lambda what, **values: answers[what]({"client": "7", **values})


def state(page):
    held = page.studio.panel.overlay._state.content
    return json.loads(html.unescape(held.partition('="')[2].partition('"')[0]))


def done(page):
    """Wait for what was asked."""
    page.studio.panel.inputs._executor.submit(lambda: None).result(10)


def test_tools_are_taken_and_shown(page, asks):
    assert state(page)["tool"] == "Orbit"
    asks("tool", name="Lasso")
    done(page)
    assert page.studio.mouse.tool == "Lasso" == state(page)["tool"]
    assert [words for words, _ in state(page)["legend"]] == ["top", "front", "in several regions"]


def test_who_may_only_look_changes_nothing(page, asks):
    asks("read_only")
    asks("tool", name="Brush")
    done(page)
    assert page.studio.mouse.tool == "Orbit"


def test_what_is_no_outline_is_refused(page, asks):
    for points in ("1,2;3", "a,b;c,d;e,f", "nan,0;1,1;0,1"):
        with pytest.raises(ValueError):
            asks("lasso", points=points)
    assert asks("lasso", points="0,0;1,1") == {}


def test_a_browser_that_has_gone_is_not_answered(page):
    with pytest.raises(KeyError):
        page.server.page.answers["tool"]({"client": "3", "name": "Grow"})
