"""The panel beside the objects: what is next, the tool in the hand, and five numbered steps."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, Protocol

import viser

from nrdf.studio.mouse import TOOLS
from nrdf.studio.panels.arm import ArmTab
from nrdf.studio.panels.object import ObjectTab
from nrdf.studio.panels.paint import PaintTab
from nrdf.studio.panels.process import ProcessTab
from nrdf.studio.panels.save import SaveTab
from nrdf.studio.panels.targets import TargetsTab

if TYPE_CHECKING:
    from nrdf.studio.app import Studio

NO_REGION = "(none yet)"
_LONG_S = 0.7
_HINTS = {
    "Turn": "Drag turns, the wheel zooms, the right button moves.",
    "Grow": "Click the surface: a patch grows from there. Its **radius** is in step 2.",
    "Brush": "Drag over the surface; drag beside the object to turn.",
    "Box": "Drag a rectangle over what you mean; take Turn to turn again.",
    "Arrow": "Drag on the reference, along the lines that the tool shall drive.",
    "Alike": "Move over the reference with the button held (or click): places that are like the "
    "one under the cursor light up. How far that reaches: a slider in step 4.",
}


@dataclass(frozen=True)
class PanelEvent:
    """What a person has done in the panel: in which browser, and the value that was set."""

    client: viser.ClientHandle
    value: Any


class Tab(Protocol):
    """One of the steps."""

    def refresh(self) -> None:
        """Show what the document says."""


class Activity:
    """Long work that goes on: what it is, how far it is, and a button that ends it."""

    def __init__(self, gui: viser.GuiApi, cancel: Callable[[], None]) -> None:
        self._what = gui.add_markdown("", visible=False)
        self._bar: Any = gui.add_progress_bar(0.0, visible=False)
        self._cancel = gui.add_button("Cancel", color="gray", visible=False)
        self._cancel.on_click(lambda _: cancel())
        self._since = 0.0

    def started(self, what: str) -> None:
        """Work begins."""
        self.says(what)
        self._bar.value = 0.0
        self._since = time.monotonic()

    def says(self, what: str) -> None:
        """What is being done now."""
        self._what.content = f"*{what} …*"

    def progress(self, done: int, total: int) -> None:
        """So much of it is done; shown once it takes long, so that the panel does not jump."""
        if time.monotonic() - self._since > _LONG_S:
            self._show(True)
        share = min(100.0, 100.0 * done / max(total, 1))
        if self._bar.value != share:
            self._bar.value = share

    def ended(self) -> None:
        """Nothing is going on any more."""
        self._show(False)

    def _show(self, visible: bool) -> None:
        for handle in (self._what, self._bar, self._cancel):
            if handle.visible != visible:
                handle.visible = visible


class Panel:
    """All that stands in the panel. Callbacks hold the studio's lock, and errors are shown."""

    def __init__(self, studio: Studio) -> None:
        self.studio, gui = studio, studio.server.gui
        self._acts = ThreadPoolExecutor(1, "studio panel")
        self._unheard: Counter[int] = Counter()
        gui.configure_theme(
            show_logo=False, show_share_button=False, brand_color=(0, 114, 178),
            control_width="large",
        )  # fmt: skip
        gui.main_panel.dock_right()
        gui.main_panel.set_width(440)
        self.next = gui.add_markdown("")
        self._error = gui.add_markdown("", visible=False)
        self.working = Activity(gui, lambda: studio.worker.cancel())
        self.driving = Activity(gui, lambda: studio.arm_simulation.worker.cancel())
        self.tool = gui.add_button_group("Mouse", TOOLS)
        self.hint = gui.add_markdown("")
        self.region = gui.add_dropdown(
            "Region", (NO_REGION,), hint="The region that you paint and describe now."
        )
        group = gui.add_tab_group()
        with group.add_tab("1 Object"):
            self.object = ObjectTab(self)
        with group.add_tab("2 Paint"):
            self.paint = PaintTab(self)
        with group.add_tab("3 Process"):
            self.process = ProcessTab(self)
        with group.add_tab("4 Targets"):
            self.targets = TargetsTab(self)
        with group.add_tab("5 Save"):
            self.save = SaveTab(self)
        with group.add_tab("6 Robot"):
            self.arm = ArmTab(self)
        self._tabs: tuple[Tab, ...] = (
            self.object, self.paint, self.process, self.targets, self.save, self.arm,
        )  # fmt: skip
        self.on(self.tool.on_click, lambda said: self._take(said.value))
        self.on(self.region.on_update, lambda said: self._choose(said.value))
        keys: tuple[tuple[str, Literal["Z", "Y"], Callable[[PanelEvent], None]], ...] = (
            ("Undo", "Z", self.undo), ("Redo", "Y", self.redo),
        )  # fmt: skip
        for label, hotkey, act in keys:
            command = gui.add_command(label, hotkey=hotkey, modifier="cmd/ctrl")
            self.on(command.on_trigger, act)

    def on(self, register: Callable[..., Any], act: Callable[[PanelEvent], None]) -> None:
        """Let a person's click or change call `act`, one after another in the order in which they
        came; not a value that the program sets."""

        # Async: on the event loop, at once, before anything can set the input to another value.
        async def answer(event: Any) -> None:
            if event.client is None:
                return
            said = PanelEvent(event.client, getattr(event.target, "value", None))
            self._unheard[id(event.target)] += 1
            self._acts.submit(self._answer, act, said, id(event.target))

        register(answer)

    def _answer(self, act: Callable[[PanelEvent], None], said: PanelEvent, handle: int) -> None:
        with self.studio.reporting_errors():
            self._unheard[handle] -= 1
            act(said)

    def set_value(self, handle: Any, value: Any) -> None:
        """Show a value in an input, unless a person has just set it to another."""
        if not self._unheard[id(handle)]:
            handle.value = value

    @staticmethod
    def set_options(handle: Any, options: tuple[str, ...]) -> None:
        """Let a dropdown have these options."""
        if handle.options != options:
            handle.options = options

    def refresh(self) -> None:
        """Show what the document, the plans and the results say."""
        studio = self.studio
        names = [region.name for region in studio.editor.document.regions]
        with studio.server.atomic():
            self.set_options(self.region, tuple(names) or (NO_REGION,))
            self.set_value(self.region, studio.region or NO_REGION)
            self.next.content = f"**Next:** {self._what_is_next()}"
            tool = studio.mouse.tool
            self.hint.content = f"In your hand: **{tool}**. {_HINTS[tool]}"
            for tab in self._tabs:
                tab.refresh()

    def show_error(self, said: str) -> None:
        """What went wrong last, or nothing."""
        if self._error.content != said:
            self._error.content = said
            self._error.visible = bool(said)

    def undo(self, _: Any = None) -> None:
        """Take the last change back."""
        self._go(self.studio.editor.session.undo(), "undo")

    def redo(self, _: Any = None) -> None:
        """Make the change again that was taken back."""
        self._go(self.studio.editor.session.redo(), "redo")

    def _go(self, went: bool, what: str) -> None:
        if not went:
            self.studio.notify("Nothing", f"there is nothing to {what}", bad=False)
            return
        self.studio.mouse.forget()
        self.studio.sync()
        self.studio.plan()

    def _take(self, tool: str) -> None:
        self.studio.mouse.take(tool)
        self.refresh()

    def _choose(self, name: str) -> None:
        if name != NO_REGION and name != self.studio.region:
            self.studio.region, self.studio.step = name, 0
            self.studio.mouse.forget()
            self.studio.draw()
            self.refresh()

    def _what_is_next(self) -> str:
        studio = self.studio
        document = studio.editor.document
        if document.reference is None:
            return "open an object in **1 Object**."
        if not document.regions:
            return "in **2 Paint**, press *New region*."
        bare = [region.name for region in document.regions if not region.mask.any()]
        if bare:
            return f"take *Grow* and click the surface where **{bare[0]}** is."
        if not document.targets:
            return (
                f"click on to let **{studio.region}** grow, or press *New region* for another "
                "place; say what is done to each in **3 Process**; then go to **4 Targets**."
            )
        waiting = [
            key for key in studio.editor.object_keys()[1:] if not studio.results.is_current(key)
        ]
        if waiting:
            return f"in **4 Targets**, press *Bring the process there* ({', '.join(waiting)})."
        uncertain = [
            key
            for key in studio.editor.object_keys()[1:]
            if studio.results.by_target[key].uncertain_regions
        ]
        if uncertain:
            return f"look at {', '.join(uncertain)}: some regions are in doubt; paint them right."
        return "save what you need in **5 Save**, or see it on an arm in **6 Robot**."
