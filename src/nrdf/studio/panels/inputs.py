"""Inputs of the panel: events in their order, values that are not overwritten, and progress."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import viser

from nrdf.studio.context import StudioContext

_SHOWN_AFTER_S = 0.7


@dataclass(frozen=True)
class PanelEvent:
    """A click or change in the panel: the browser that it came from, and the value that was set."""

    client: viser.ClientHandle
    value: Any


class Inputs:
    """Connects buttons and fields to what they do."""

    def __init__(self, context: StudioContext) -> None:
        self.context = context
        self._executor = ThreadPoolExecutor(1, "studio panel")
        self._pending: Counter[int] = Counter()

    def on(self, register: Callable[..., Any], act: Callable[[PanelEvent], None]) -> None:
        """Call `act` for a person's click or change, one after another in the order in which they
        came; not for a value that the program sets. `act` holds the lock, and its errors are shown.
        """

        # Async: on the event loop, at once, before anything can set the input to another value.
        async def answer(event: Any) -> None:
            if event.client is None:
                return
            panel_event = PanelEvent(event.client, getattr(event.target, "value", None))
            self._pending[id(event.target)] += 1
            self._executor.submit(self._answer, act, panel_event, id(event.target))

        register(answer)

    def soon(self, act: Callable[[], None]) -> None:
        """Call `act` after all clicks and changes that came before."""

        def answer() -> None:
            with self.context.reporting_errors():
                act()

        self._executor.submit(answer)

    def set_value(self, handle: Any, value: Any) -> None:
        """Show a value in an input, unless a person has just set it to another."""
        if not self._pending[id(handle)]:
            handle.value = value

    @staticmethod
    def set_options(handle: Any, options: tuple[str, ...]) -> None:
        """Set the options of a dropdown."""
        if handle.options != options:
            handle.options = options

    def _answer(self, act: Callable[[PanelEvent], None], event: PanelEvent, handle: int) -> None:
        with self.context.reporting_errors():
            self._pending[handle] -= 1
            act(event)


class ProgressBar:
    """Work in the background: what it is, how much is done, and a button that cancels it."""

    def __init__(self, gui: viser.GuiApi, cancel: Callable[[], None]) -> None:
        self._what = gui.add_markdown("", visible=False)
        self._bar: Any = gui.add_progress_bar(0.0, visible=False)
        self._cancel = gui.add_button("Cancel", color="gray", visible=False)
        self._cancel.on_click(lambda _: cancel())
        self._since = 0.0

    def started(self, what: str) -> None:
        """Work has begun."""
        self.describe(what)
        self._bar.value = 0.0
        self._since = time.monotonic()

    def describe(self, what: str) -> None:
        """Say what is done now."""
        self._what.content = f"*{what} …*"

    def progress(self, done: int, total: int) -> None:
        """Show the share that is done, once the work takes long, so that the panel stays still."""
        if time.monotonic() - self._since > _SHOWN_AFTER_S:
            self._show(True)
        share = min(100.0, 100.0 * done / max(total, 1))
        if self._bar.value != share:
            self._bar.value = share

    def ended(self) -> None:
        """Hide the bar."""
        self._show(False)

    def _show(self, visible: bool) -> None:
        for handle in (self._what, self._bar, self._cancel):
            if handle.visible != visible:
                handle.visible = visible
