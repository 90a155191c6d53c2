"""Step 3: what is done to a region."""

from __future__ import annotations

import re
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from nrdf.process.new_knowledge import KINDS
from nrdf.reports.transfer_report import short_metric_cells
from nrdf.studio.model.teaching import NUMBERS, ORIGIN, PATTERNS, shown_numbers, si_name

if TYPE_CHECKING:
    from nrdf.studio.panels.panel import Panel, PanelEvent

_LABELS = {
    "stepover_mm": ("Between lines, mm", "stepover_mm: distance between neighbouring lines"),
    "spacing_mm": ("Between waypoints, mm", "spacing_mm: along a line"),
    "edge_margin_mm": ("Free at the edge, mm", "edge_margin_mm: kept free inside the border"),
    "passes": ("Passes", "passes: how often the lines are driven"),
    "force_n": ("Force, N", "force_n: along the tool; 0: none"),
    "force_tolerance_n": ("Force may be off by, N", "force_tolerance_n; 0: not said"),
    "feed_mm_s": ("Speed, mm/s", "feed_mm_s: along the lines"),
    "lead_deg": ("Lead, °", "lead_deg: the tool's tail leans towards the travel"),
    "tilt_deg": ("Tilt, °", "tilt_deg: to the right of it"),
    "standoff_mm": ("Above the surface, mm", "standoff_mm: 0 where the tool touches"),
    "spindle_rpm": ("Spindle, rpm", "spindle_rpm; 0: none"),
}


class ProcessTab:
    """Choose a kind of process and its parameters; the plan is drawn at once."""

    def __init__(self, panel: Panel) -> None:
        self.panel, self.studio = panel, panel.studio
        gui = self.studio.server.gui
        gui.add_markdown("Say what is done to the region; the tool path is drawn at once.")
        self.status = gui.add_markdown("")
        self.kind = gui.add_dropdown(
            "What is done", KINDS, hint="Choosing one fills in sensible values."
        )
        self.pattern = gui.add_dropdown("Pattern", PATTERNS)
        self.numbers = {
            name: gui.add_number(
                _LABELS[name][0], 0.0, step=_increment(name), hint=_LABELS[name][1]
            )
            for name in NUMBERS[:2]
        }
        self.direction = gui.add_markdown("")
        self.longest = gui.add_button("Lines along the longest way", color="gray")
        rest = [name for name in NUMBERS if name not in self.numbers]
        for name in ("force_n", "feed_mm_s", "tilt_deg"):
            self.numbers[name] = self._number(name)
        self.tool = gui.add_text("Tool", "tool")
        self.tool_radius = gui.add_number("Tool's radius, mm", 25.0, step=1.0)
        with gui.add_folder("More", expand_by_default=False):
            for name in rest:
                if name not in self.numbers:
                    self.numbers[name] = self._number(name)
            self.tool_clearance = gui.add_number(
                "Room the tool needs, mm", 0.0, step=1.0,
                hint="Free before the surface; places with less are left out. 0: not looked at.",
            )  # fmt: skip
            self.step = gui.add_dropdown("Step", ("1",), hint="One after another on a region.")
            self.steps = gui.add_button_group("Steps", ("Add one", "Remove this"))
        for name, handle in self.numbers.items():
            panel.on(handle.on_update, partial(self._number_set, name))
        panel.on(self.kind.on_update, lambda said: self._kind(said.value))
        panel.on(self.pattern.on_update, lambda said: self._change(trajectory=said.value))
        panel.on(self.longest.on_click, lambda _: self._change(direction=None))
        panel.on(self.tool.on_update, lambda _: self._tool())
        panel.on(self.tool_radius.on_update, lambda _: self._tool())
        panel.on(self.tool_clearance.on_update, lambda _: self._tool())
        panel.on(self.step.on_update, lambda said: self._step(said.value))
        panel.on(self.steps.on_click, lambda said: self._steps(said.value))

    def refresh(self) -> None:
        """The step that is described now, and its plan."""
        studio = self.studio
        region = studio.editor.document.region(studio.region)
        if region is None:
            self.status.content = "Paint a region in step 2 first."
            return
        step = region.steps[studio.step]
        self.panel.set_value(self.kind, str(step["kind"]))
        pattern = str(step.get("trajectory", "raster"))
        self.panel.set_options(
            self.pattern, PATTERNS if pattern in PATTERNS else (*PATTERNS, pattern)
        )
        self.panel.set_value(self.pattern, pattern)
        for name, value in shown_numbers(step).items():
            self.panel.set_value(self.numbers[name], value)
        self.panel.set_value(self.tool, str(step["tool"].get("name", "tool")))
        for handle, length in (
            (self.tool_radius, "radius_m"),
            (self.tool_clearance, "clearance_m"),
        ):
            self.panel.set_value(handle, float(f"{1e3 * step['tool'].get(length, 0.0):.6g}"))
        names = tuple(f"{i + 1}: {s.get('name', s['kind'])}" for i, s in enumerate(region.steps))
        self.panel.set_options(self.step, names)
        self.panel.set_value(self.step, names[studio.step])
        direction = step.get("direction")
        self.direction.content = (
            "Lines run along the region's longest way; take *Arrow* and drag to say otherwise."
            if direction is None
            else f"Lines run along ({', '.join(f'{x:.2f}' for x in direction)}): the arrow."
        )
        self.status.content = self._plan()

    def _plan(self) -> str:
        studio = self.studio
        region = studio.editor.document.region(studio.region)
        assert region is not None
        if not region.mask.any():
            return f"**{region.name}** has no points yet."
        plan = studio.results.plan(region, studio.step)
        if plan is None:
            return "*planning …*"
        if plan.fault or plan.checked is None or plan.checked.metrics is None:
            return f"⚠ {_labelled(plan.fault)}"
        metrics = plan.checked.metrics
        worked, left_out, missed, widest, step, turn, off, _ = short_metric_cells(vars(metrics))
        minutes, seconds = divmod(round(metrics.cycle_time_s), 60)
        lines = [
            f"**{metrics.process_length_m:.2f} m** of lines, **{minutes} min {seconds} s**, "
            f"of the region **{worked} %** worked, {left_out} % left out, {missed} % missed",
            f"lines at most {widest} mm apart, {off} mm off the object; steps of at most {step} "
            f"mm, turns of at most {turn}°",
        ]
        lines += [f"⚠ {warning}" for warning in plan.checked.warnings]
        return "  \n".join(lines)

    def _number(self, name: str) -> Any:
        label, hint = _LABELS[name]
        return self.studio.server.gui.add_number(label, 0.0, step=_increment(name), hint=hint)

    def _number_set(self, name: str, said: PanelEvent) -> None:
        self.studio.need_region()
        value = float(said.value)
        if not np.isfinite(value):
            return
        self.studio.editor.change_numbers(self.studio.region, self.studio.step, {name: value})
        self._changed()

    def _kind(self, kind: str) -> None:
        self.studio.need_region()
        self.studio.editor.restart_step(self.studio.region, self.studio.step, kind)
        self._changed()

    def _change(self, **content: object) -> None:
        self.studio.need_region()
        self.studio.editor.change_step(self.studio.region, self.studio.step, **content)
        self._changed()

    def _tool(self) -> None:
        self.studio.need_region()
        region = self.studio.editor.document.region(self.studio.region)
        assert region is not None
        tool = dict(region.steps[self.studio.step]["tool"])
        tool |= {
            "name": self.tool.value,
            "radius_m": self.tool_radius.value / 1e3,
            "clearance_m": self.tool_clearance.value / 1e3,
        }
        self._change(tool=tool)

    def _step(self, shown: str) -> None:
        self.studio.step = int(shown.partition(":")[0]) - 1
        self.studio.draw()
        self.refresh()

    def _steps(self, which: str) -> None:
        studio = self.studio
        studio.need_region()
        if which == "Add one":
            studio.step = studio.editor.add_step(studio.region, self.kind.value)
        else:
            studio.editor.remove_step(studio.region, studio.step)
            studio.step = max(studio.step - 1, 0)
        self._changed()

    def _changed(self) -> None:
        self.studio.draw()
        self.panel.refresh()
        self.studio.plan()


def _labelled(fault: str) -> str:
    """A fault with the page's names of fields beside those of a knowledge file."""
    fault = fault.removeprefix(f"{ORIGIN}: ")
    for name, (label, _) in _LABELS.items():
        fault = re.sub(rf"\b{si_name(name)}\b", f"{si_name(name)} (*{label}*)", fault, count=1)
    return fault


def _increment(name: str) -> float:
    return 1.0 if name.endswith(("_mm", "_s", "_rpm", "passes")) else 0.5
