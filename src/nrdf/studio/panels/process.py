"""Step 3: the processes of a region."""

from __future__ import annotations

import re
import time
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from nrdf.process.new_knowledge import KINDS
from nrdf.reports.transfer_report import short_metric_cells
from nrdf.studio.context import StudioContext
from nrdf.studio.model.document import REFERENCE, PaintedRegion
from nrdf.studio.model.teaching import NUMBERS, ORIGIN, PATTERNS, shown_numbers, si_name
from nrdf.studio.panels.inputs import Inputs, PanelEvent
from nrdf.studio.scene.colours import COLOURINGS, RESULT

_LABELS = {
    "stepover_mm": ("Stepover, mm", "stepover_mm: distance between neighbouring lines"),
    "spacing_mm": ("Waypoint spacing, mm", "spacing_mm: distance of waypoints along a line"),
    "edge_margin_mm": ("Edge margin, mm", "edge_margin_mm: kept free inside the region's border"),
    "passes": ("Passes", "passes: how often the lines are run"),
    "force_n": ("Force, N", "force_n: along the tool axis; 0: no force control"),
    "force_tolerance_n": ("Force tolerance, N", "force_tolerance_n; 0: not given"),
    "feed_mm_s": ("Feed, mm/s", "feed_mm_s: speed along the lines"),
    "lead_deg": ("Lead, °", "lead_deg: tilt of the tool axis towards the travel"),
    "tilt_deg": ("Tilt, °", "tilt_deg: tilt of the tool axis to the right of the travel"),
    "standoff_mm": ("Stand-off, mm", "standoff_mm: height above the surface; 0: contact"),
    "spindle_rpm": ("Spindle, rpm", "spindle_rpm; 0: none"),
}
_SLIDERS = {
    "stepover_mm": (1.0, 100.0, 0.5), "feed_mm_s": (1.0, 500.0, 1.0),
    "tilt_deg": (-60.0, 60.0, 1.0), "edge_margin_mm": (0.0, 50.0, 0.5),
}  # fmt: skip
"""Numbers to be dragged: from, to, in steps of. A file's own may lie outside."""
_SAME_DRAG_S = 1.0  # between changes of a number that are undone together
_BODY = {
    "body_length_m": (
        "Tool body length, mm",
        "body_length_mm: of the cylinder behind the tool centre point; places where it would touch "
        "the object are warned of. 0: not checked.",
    ),
    "body_radius_m": ("Tool body radius, mm", "body_radius_mm; 0: that of the footprint"),
}
_AMOUNTS = ("thickness_um", "removal_um")
_SHOWN = ("kind", "trajectory", "direction", "tool", *(si_name(name) for name in NUMBERS))
_SHOWN_OF_TOOL = ("name", "radius_m", "clearance_m", *_BODY)
_MAIN = ("stepover_mm", "edge_margin_mm"), ("force_n", "feed_mm_s", "tilt_deg")


class ProcessTab:
    """Choose a kind of process and its parameters; the plan is drawn at once."""

    def __init__(self, context: StudioContext, inputs: Inputs) -> None:
        self.context, self.inputs = context, inputs
        gui = context.server.gui
        gui.add_markdown("Describe the process of the region; its tool path is drawn at once.")
        self.status = gui.add_markdown("")
        self.plan = gui.add_button("Plan the tool paths", color="green", visible=False)
        self.kind = gui.add_dropdown("Process", KINDS, hint="Choosing one fills in usual values.")
        self.pattern = gui.add_dropdown("Pattern", PATTERNS)
        self.numbers = {name: self._number(name) for name in _MAIN[0]}
        self.direction = gui.add_markdown("")
        self.longest = gui.add_button("Lines along the longest axis", color="gray")
        self.numbers |= {name: self._number(name) for name in _MAIN[1]}
        self.tool = gui.add_text("Tool", "tool")
        self.tool_radius = gui.add_number("Tool radius, mm", 25.0, step=1.0)
        self.map = gui.add_checkbox(
            "Show film or depth", False, visible=False,
            hint="What the process leaves: blue too little, red too much. While a number is "
            "dragged, at one feed.",
        )  # fmt: skip
        self._dragged: tuple[object, float] = None, 0.0
        with gui.add_folder("More", expand_by_default=False):
            more = [name for name in NUMBERS if name not in self.numbers]
            self.numbers |= {name: self._number(name) for name in more}
            self.tool_clearance = gui.add_number(
                "Tool clearance, mm", 0.0, step=1.0,
                hint="Free space that the tool needs above the surface; points with less are left "
                "out. 0: not checked.",
            )  # fmt: skip
            self.body = {
                name: gui.add_number(label, 0.0, step=1.0, hint=hint)
                for name, (label, hint) in _BODY.items()
            }
            self.step = gui.add_dropdown(
                "Process step", ("1",), hint="Steps are run one after another on the region."
            )
            self.steps = gui.add_button_group("Steps", ("Add", "Remove"))
        for name, handle in self.numbers.items():
            inputs.on(handle.on_update, partial(self._set_number, name))
        inputs.on(self.plan.on_click, lambda _: self._plan_now())
        inputs.on(self.map.on_update, lambda event: self._show_map(event.value))
        inputs.on(self.kind.on_update, lambda event: self._set_kind(event.value))
        inputs.on(self.pattern.on_update, lambda event: self._change(trajectory=event.value))
        inputs.on(self.longest.on_click, lambda _: self._change(direction=None))
        inputs.on(self.tool.on_update, lambda event: self._set_tool("name", event.value))
        lengths = {"radius_m": self.tool_radius, "clearance_m": self.tool_clearance, **self.body}
        for name, handle in lengths.items():
            inputs.on(handle.on_update, partial(self._set_length, name))
        inputs.on(self.step.on_update, lambda event: self._select_step(event.value))
        inputs.on(self.steps.on_click, lambda event: self._change_steps(event.value))

    def refresh(self) -> None:
        """Show the selected process step and its plan."""
        context, inputs = self.context, self.inputs
        region = context.editor.document.region(context.region)
        if region is None:
            self.status.content = "Paint a region in step 2 first."
            self.plan.visible = False
            return
        step = region.steps[context.step]
        inputs.set_value(self.kind, str(step["kind"]))
        pattern = str(step.get("trajectory", "raster"))
        patterns = PATTERNS if pattern in PATTERNS else (*PATTERNS, pattern)
        inputs.set_options(self.pattern, patterns)
        inputs.set_value(self.pattern, pattern)
        for name, value in shown_numbers(step).items():
            if name in _SLIDERS:
                low, high, _ = _SLIDERS[name]
                self.numbers[name].min = min(low, value)
                self.numbers[name].max = max(high, value)
            inputs.set_value(self.numbers[name], value)
        tool = step["tool"]
        inputs.set_value(self.tool, str(tool.get("name", "tool")))
        inputs.set_value(self.tool_radius, _millimetres(tool.get("radius_m", 0.0)))
        inputs.set_value(self.tool_clearance, _millimetres(tool.get("clearance_m", 0.0)))
        for name, handle in self.body.items():
            inputs.set_value(handle, _millimetres(tool.get(name) or 0.0))
        names = tuple(f"{i + 1}: {s.get('name', s['kind'])}" for i, s in enumerate(region.steps))
        inputs.set_options(self.step, names)
        inputs.set_value(self.step, names[context.step])
        direction = step.get("direction")
        self.direction.content = (
            "Lines run along the region's longest axis; the tool *Direction* changes that."
            if direction is None
            else f"Lines run along ({', '.join(f'{x:.2f}' for x in direction)}): the arrow."
        )
        self.status.content = "  \n".join([self._plan(region), *kept_as_it_is(step)])
        self.map.visible = bool(context.results.left_on(REFERENCE))
        inputs.set_value(self.map, context.colouring == RESULT)
        self.plan.visible = bool(region.mask.any()) and "Not planned" in self.status.content

    def _plan(self, region: PaintedRegion) -> str:
        """The metrics of the plan, in Markdown, or why there is none."""
        if not region.mask.any():
            return f"**{region.name}** has no points yet."
        results, step = self.context.results, self.context.step
        plan = results.shown_plan(region, step)
        if plan is None:
            planning = self.context.worker.has_job("plan")
            return "*planning …*" if planning else "Not planned yet."
        if plan.fault or plan.checked is None or plan.checked.metrics is None:
            return f"⚠ {_labelled(plan.fault)}"
        metrics = plan.checked.metrics
        covered, left_out, missed, widest, longest, turn, off, _ = short_metric_cells(vars(metrics))
        minutes, seconds = divmod(round(metrics.cycle_time_s), 60)
        lines = [
            f"**{metrics.process_length_m:.2f} m** of lines, **{minutes} min {seconds} s**, "
            f"of the region **{covered} %** worked, {left_out} % left out, {missed} % missed",
        ]
        if plan.left is not None:
            lines.append(f"**{plan.left.within:.0%}** of it has the {plan.left.what} wanted")
        if results.plan(region, step) is None:
            return "  \n".join([*lines, "*a first look; it is planned when you let go*"])
        lines.append(
            f"lines at most {widest} mm apart, {off} mm off the object; steps of at most {longest} "
            f"mm, turns of at most {turn}°"
        )
        lines += [f"⚠ {warning}" for warning in plan.checked.warnings]
        return "  \n".join(lines)

    def _number(self, name: str) -> Any:
        (label, hint), gui = _LABELS[name], self.context.server.gui
        if name in _SLIDERS:
            low, high, step = _SLIDERS[name]
            return gui.add_slider(label, low, high, step, low, hint=hint)
        return gui.add_number(label, 0.0, step=_increment(name), hint=hint)

    def _set_number(self, name: str, event: PanelEvent) -> None:
        context = self.context
        context.need_region()
        value = float(event.value)
        if not np.isfinite(value):
            return
        which, now = (context.region, context.step, name), time.monotonic()
        again = self._dragged[0] == which and now - self._dragged[1] < _SAME_DRAG_S
        self._dragged = which, now
        context.editor.change_numbers(context.region, context.step, {name: value}, again)
        context.look(context.region, context.step)
        self.refresh()

    def _set_kind(self, kind: str) -> None:
        self.context.need_region()
        self.context.editor.restart_step(self.context.region, self.context.step, kind)
        self._changed()

    def _change(self, **content: object) -> None:
        self.context.need_region()
        self.context.editor.change_step(self.context.region, self.context.step, **content)
        self._changed()

    def _set_length(self, name: str, event: PanelEvent) -> None:
        length = float(event.value) / 1e3
        self._set_tool(name, None if name in self.body and length == 0.0 else length)

    def _set_tool(self, key: str, value: str | float | None) -> None:
        """Change one key of the tool. What other fields show is not read: a plan that has just
        ended may be writing them."""
        self.context.need_region()
        region = self.context.editor.document.region(self.context.region)
        assert region is not None
        tool = {**region.steps[self.context.step]["tool"], key: value}
        self._change(tool={name: value for name, value in tool.items() if value is not None})

    def _select_step(self, shown: str) -> None:
        self.context.step = int(shown.partition(":")[0]) - 1
        self.context.draw()
        self.refresh()

    def _change_steps(self, which: str) -> None:
        context = self.context
        context.need_region()
        if which == "Add":
            context.step = context.editor.add_step(context.region, self.kind.value)
        else:
            context.editor.remove_step(context.region, context.step)
            context.step = max(context.step - 1, 0)
        self._changed()

    def _show_map(self, shown: bool) -> None:
        self.context.recolour(RESULT if shown else COLOURINGS[0], self.context.similarity_width)
        self.context.refresh_panel()

    def _plan_now(self) -> None:
        self.context.plan(0.0)

    def _changed(self) -> None:
        self.context.draw()
        self.context.plan()


def kept_as_it_is(step: Mapping[str, Any]) -> list[str]:
    """What a step has beyond the fields of the page, in Markdown; [] for nothing."""
    more = {k: v for k, v in step.items() if k not in _SHOWN}
    more |= {f"tool.{k}": v for k, v in step["tool"].items() if k not in _SHOWN_OF_TOOL}
    said = [f"{name} **{amount_words(v)}**" for name, v in more.items() if name in _AMOUNTS]
    rest = ", ".join(name for name in more if name not in _AMOUNTS)
    lines = [f"The result that is wanted: {', '.join(said)}; feeds follow from it."] if said else []
    return lines + ([f"Set as well, and kept as it is: {rest}."] if rest else [])


def amount_words(amount: Any) -> str:
    """An amount in µm as a file has it, such as "60 ± 10 µm"."""
    if not isinstance(amount, Mapping):
        return str(amount)
    return f"{amount.get('value', 0):g} ± {amount.get('tolerance', 0):g} µm"


def _labelled(fault: str) -> str:
    """A fault with the page's labels of fields beside their names in a knowledge file."""
    fault = fault.removeprefix(f"{ORIGIN}: ")
    for name, (label, _) in _LABELS.items():
        fault = re.sub(rf"\b{si_name(name)}\b", f"{si_name(name)} (*{label}*)", fault, count=1)
    return fault


def _increment(name: str) -> float:
    return 1.0 if name.endswith(("_mm", "_s", "_rpm", "passes")) else 0.5


def _millimetres(metres: float) -> float:
    return float(f"{1e3 * metres:.6g}")
