"""Inputs: one after another, without overwriting what a person sets, and progress once it lasts."""

from __future__ import annotations

import asyncio
from types import SimpleNamespace

import pytest

pytest.importorskip("viser", reason="pip install 'nrdf[studio]'")

from nrdf.errors import RegionError
from nrdf.studio.panels.inputs import Inputs, ProgressBar

BROWSER = SimpleNamespace(client_id=7)


def events(inputs, act):
    """The function that the browser's events call for `act`."""
    registered = []
    inputs.on(registered.append, act)
    return registered[0]


def test_a_value_that_a_person_has_just_set_is_not_overwritten(page):
    inputs = Inputs(page.studio)
    handle, done = SimpleNamespace(value="old"), []
    send = events(inputs, lambda event: done.append(event.value))
    with page.studio.lock:  # the event waits for it
        handle.value = "typed"
        asyncio.run(send(SimpleNamespace(client=BROWSER, target=handle)))
        inputs.set_value(handle, "from the program")
        assert handle.value == "typed" and not done
    inputs._executor.shutdown()
    assert done == ["typed"]
    inputs.set_value(handle, "from the program")
    assert handle.value == "from the program"


def test_values_of_the_program_are_no_events_and_errors_are_shown(page):
    inputs = Inputs(page.studio)

    def refuse(event):
        raise RegionError("no such region")

    send = events(inputs, refuse)
    asyncio.run(send(SimpleNamespace(client=None, target=SimpleNamespace(value=1))))
    assert not inputs._pending
    asyncio.run(send(SimpleNamespace(client=BROWSER, target=SimpleNamespace(value=1))))
    inputs._executor.shutdown()
    assert "no such region" in page.studio.panel.error.content


def test_progress_is_shown_once_work_lasts(page):
    bar = ProgressBar(page.server.gui, lambda: None)
    bar.started("planning")
    bar.progress(1, 4)
    assert not bar._bar.visible and bar._bar.value == 25.0
    bar._since -= 10.0
    bar.progress(2, 4)
    assert bar._bar.visible and "planning" in bar._what.content
    bar.ended()
    assert not bar._bar.visible and not bar._cancel.visible
