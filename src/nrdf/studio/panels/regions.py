"""Step 2: the regions of the reference."""

from __future__ import annotations

from typing import Any

import numpy as np

from nrdf.errors import RegionError
from nrdf.studio.context import StudioContext
from nrdf.studio.model.document import REFERENCE
from nrdf.studio.mouse import Mouse
from nrdf.studio.panels.inputs import Inputs
from nrdf.studio.tools import TOOLS


class RegionsTab:
    """Make, name, colour and paint regions."""

    def __init__(self, context: StudioContext, inputs: Inputs, mouse: Mouse) -> None:
        self.context, self.inputs, self.mouse = context, inputs, mouse
        gui = context.server.gui
        gui.add_markdown("Paint the regions that are to be worked.")
        self.new = gui.add_button("New region")
        self.name = gui.add_text("Name", "")
        self.colour = gui.add_rgb("Colour", (230, 159, 0))
        self.radius = gui.add_slider(
            "Radius, mm", 5, 500, 1, 50,
            hint="Along the surface. It also changes the patch that was grown last.",
        )  # fmt: skip
        self.through = gui.add_checkbox(
            "Rectangle takes hidden points too", False, hint="Otherwise only points that you see."
        )
        self.status = gui.add_markdown("")
        self.history = gui.add_button_group("History", ("Undo", "Redo"))
        self.more = gui.add_button_group("This region", ("Mirror", "Clear", "Delete"))
        self.overlap = gui.add_checkbox("Regions may overlap", False)
        inputs.on(self.new.on_click, lambda _: self._new())
        inputs.on(self.name.on_update, lambda event: self._rename(event.value))
        inputs.on(self.colour.on_update, lambda event: self._recolour(event.value))
        inputs.on(self.radius.on_update, lambda event: mouse.set_radius(1e-3 * event.value))
        inputs.on(self.through.on_update, lambda event: setattr(mouse, "through", event.value))
        inputs.on(self.history.on_click, lambda event: self._history(event.value))
        inputs.on(self.more.on_click, lambda event: self._more(event.value))
        inputs.on(self.overlap.on_update, lambda event: self._overlap(event.value))

    def refresh(self) -> None:
        """Show the selected region."""
        context, editor = self.context, self.context.editor
        region = editor.document.region(context.region)
        self.inputs.set_value(self.radius, int(np.clip(round(1e3 * context.radius_m), 5, 500)))
        self.inputs.set_value(self.overlap, editor.document.allow_overlap)
        if region is None:
            self.status.content = "There is no region yet."
            return
        self.inputs.set_value(self.name, region.name)
        self.inputs.set_value(self.colour, region.colour)
        count, share = int(region.mask.sum()), float(region.mask.mean())
        lines = [f"**{region.name}**: {count} points, {share:.1%} of the object."]
        overlaps = [] if editor.document.allow_overlap else editor.overlaps()
        lines += [f"⚠ {line.split(';')[0]}: the dark points." for line in overlaps]
        self.status.content = "  \n".join(lines)

    def undo(self, _: Any = None) -> None:
        """Undo the last change."""
        self._show_change(self.context.editor.session.undo(), "undo")

    def redo(self, _: Any = None) -> None:
        """Make the change again that was undone last."""
        self._show_change(self.context.editor.session.redo(), "redo")

    def _show_change(self, changed: bool, what: str) -> None:
        if not changed:
            self.context.notify("Nothing", f"there is nothing to {what}", bad=False)
            return
        self.mouse.forget_patch()
        self.context.sync()
        self.context.plan()

    def _new(self) -> None:
        context = self.context
        if context.editor.document.reference is None:
            raise RegionError("there is no object to paint on: open one in step 1")
        context.region, context.step = context.editor.add_region(), 0
        if self.mouse.tool == TOOLS[0].name:
            self.mouse.select_tool("Grow")
        context.sync()

    def _rename(self, name: str) -> None:
        context = self.context
        context.need_region()
        try:
            context.editor.rename_region(context.region, name)
            context.region = name.strip()
        finally:
            context.sync()
        context.plan()

    def _recolour(self, colour: tuple[int, int, int]) -> None:
        self.context.need_region()
        self.context.editor.recolour_region(self.context.region, colour)
        self.context.draw()

    def _overlap(self, allowed: bool) -> None:
        self.context.editor.allow_overlap(allowed)
        self.refresh()

    def _history(self, which: str) -> None:
        if which == "Undo":
            self.undo()
        else:
            self.redo()

    def _more(self, which: str) -> None:
        context, editor = self.context, self.context.editor
        context.need_region()
        mask: Any = editor.mask(REFERENCE, context.region)
        if which == "Delete":
            editor.remove_region(context.region)
        elif which == "Clear":
            editor.paint(REFERENCE, context.region, np.zeros_like(mask))
        else:
            mirrored = editor.paintable(REFERENCE).canvas.mirrored(mask)
            editor.paint(REFERENCE, context.region, mask | mirrored)
        self.mouse.forget_patch()
        context.sync()
        context.plan()
