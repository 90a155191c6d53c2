"""The panel beside the objects: the next step, the region, and six numbered tabs."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Literal, Protocol

from nrdf.studio.arm_simulation import ArmSimulation
from nrdf.studio.context import StudioContext
from nrdf.studio.mouse import Mouse
from nrdf.studio.overlay import Overlay
from nrdf.studio.panels.inputs import Inputs, PanelEvent, ProgressBar
from nrdf.studio.panels.process import ProcessTab
from nrdf.studio.panels.reference import ReferenceTab
from nrdf.studio.panels.regions import RegionsTab
from nrdf.studio.panels.robot import RobotTab
from nrdf.studio.panels.save import SaveTab
from nrdf.studio.panels.standing import unconfirmed
from nrdf.studio.panels.targets import TargetsTab
from nrdf.studio.tools import ACTS, ERASE, TOOLS, tool

NO_REGION = "(none yet)"


class Tab(Protocol):
    """One of the steps."""

    def refresh(self) -> None:
        """Show what the document says."""


class Panel:
    """Everything in the panel. cancel: cancels the work in the background."""

    def __init__(
        self,
        context: StudioContext,
        mouse: Mouse,
        simulation: ArmSimulation,
        cancel: Callable[[], None],
    ) -> None:
        self.context, self.mouse, gui = context, mouse, context.server.gui
        self.inputs = inputs = Inputs(context)
        gui.configure_theme(
            show_logo=False, show_share_button=False, brand_color=(0, 114, 178),
            control_width="large",
        )  # fmt: skip
        gui.main_panel.dock_right()
        gui.main_panel.set_width(480)
        self.next = gui.add_markdown("")
        self.error = gui.add_markdown("", visible=False)
        self.working = ProgressBar(gui, cancel)
        self.simulating = ProgressBar(gui, lambda: simulation.worker.cancel())
        self.hint = gui.add_markdown("")
        self.region = gui.add_dropdown(
            "Region", (NO_REGION,), hint="The region that is painted and described now."
        )
        group = gui.add_tab_group()
        with group.add_tab("1 Reference"):
            self.reference = ReferenceTab(context, inputs)
        with group.add_tab("2 Regions"):
            self.regions = RegionsTab(context, inputs, mouse)
        with group.add_tab("3 Process"):
            self.process = ProcessTab(context, inputs)
        with group.add_tab("4 Targets"):
            self.targets = TargetsTab(context, inputs)
        with group.add_tab("5 Save"):
            self.save = SaveTab(context, inputs)
        with group.add_tab("6 Robot"):
            self.robot = RobotTab(context, inputs, simulation)
        self._tabs: tuple[Tab, ...] = (
            self.reference, self.regions, self.process, self.targets, self.save, self.robot,
        )  # fmt: skip
        for each in (*TOOLS, ERASE, *ACTS):
            command = gui.add_command(each.name, hotkey=each.key)
            inputs.on(command.on_trigger, partial(self._take, each.name))
        self.overlay = Overlay(context, mouse, simulation, inputs, self)
        inputs.on(self.region.on_update, lambda event: self._select_region(event.value))
        keys: tuple[tuple[str, Literal["Z", "Y"], Callable[[PanelEvent], None]], ...] = (
            ("Undo", "Z", self.regions.undo), ("Redo", "Y", self.regions.redo),
        )  # fmt: skip
        for label, hotkey, act in keys:
            command = gui.add_command(label, hotkey=hotkey, modifier="cmd/ctrl")
            inputs.on(command.on_trigger, act)

    def refresh(self) -> None:
        """Show what the document, the plans and the results say."""
        context = self.context
        names = [region.name for region in context.editor.document.regions]
        with context.server.atomic():
            self.inputs.set_options(self.region, tuple(names) or (NO_REGION,))
            self.inputs.set_value(self.region, context.region or NO_REGION)
            self.next.content = f"**Next:** {next_step(context)}"
            held = tool(self.mouse.tool)
            said = self.mouse.measured or held.hint
            erases = " It takes away." if self.mouse.erase else ""
            self.hint.content = f"Mouse tool **{held.name}**: {said}{erases}"
            self.overlay.refresh()
            for tab in self._tabs:
                tab.refresh()

    def show_error(self, text: str) -> None:
        """Show what went wrong last; "" removes it."""
        if self.error.content != text:
            self.error.content = text
            self.error.visible = bool(text)

    def _take(self, name: str, _: PanelEvent) -> None:
        self.take(name)

    def take(self, name: str) -> None:
        """Take a tool, or do one of the acts."""
        if any(name == each.name for each in TOOLS):
            self.mouse.select_tool(name)
        else:
            self.mouse.act(name)
        self.refresh()

    def _select_region(self, name: str) -> None:
        if name != NO_REGION and name != self.context.region:
            self.context.region, self.context.step = name, 0
            self.mouse.forget_patch()
            self.context.draw()
            self.refresh()


def next_step(context: StudioContext) -> str:
    """What to do next, in Markdown."""
    document, results = context.editor.document, context.results
    if document.reference is None:
        return "open a reference in **1 Reference**."
    if not document.regions:
        return "in **2 Regions**, press *New region*."
    empty = [region.name for region in document.regions if not region.mask.any()]
    if empty:
        return f"take *Grow* and click the surface where **{empty[0]}** is."
    if not document.targets:
        return (
            f"click on to enlarge **{context.region}**, or press *New region* for another one; "
            "describe the process of each in **3 Process**; then go to **4 Targets**."
        )
    targets = context.editor.object_keys()[1:]
    if unsure := unconfirmed(context):
        return (
            f"say in **4 Targets** how {unsure[0]} stands: press *It stands like this*, or turn it."
        )
    waiting = [key for key in targets if not results.is_current(key)]
    if waiting:
        return f"in **4 Targets**, press *Transfer the process* ({', '.join(waiting)})."
    uncertain = [key for key in targets if results.by_target[key].uncertain_regions]
    if uncertain:
        return f"check {', '.join(uncertain)}: regions with low confidence; correct them by hand."
    return "save what you need in **5 Save**, or simulate it on an arm in **6 Robot**."
