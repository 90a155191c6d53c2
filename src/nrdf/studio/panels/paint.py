"""Step 2: the regions of the reference."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nrdf.errors import RegionError
from nrdf.studio.model.document import REFERENCE

if TYPE_CHECKING:
    from nrdf.studio.panels.panel import Panel


class PaintTab:
    """Make, name, colour and paint regions."""

    def __init__(self, panel: Panel) -> None:
        self.panel, self.studio = panel, panel.studio
        gui = self.studio.server.gui
        gui.add_markdown("Paint each place that is to be worked; several if you like.")
        self.new = gui.add_button("New region")
        self.name = gui.add_text("Name", "")
        self.colour = gui.add_rgb("Colour", (230, 159, 0))
        self.radius = gui.add_slider(
            "Radius, mm", 5, 500, 1, 50,
            hint="Along the surface; move it after a click, and the patch follows.",
        )  # fmt: skip
        self.erase = gui.add_checkbox("Erase instead of paint", False)
        self.through = gui.add_checkbox(
            "Box takes what is hidden too", False, hint="Else only points that you see."
        )
        self.status = gui.add_markdown("")
        self.history = gui.add_button_group("History", ("Undo", "Redo"))
        self.more = gui.add_button_group("More", ("Mirror", "Clear", "Delete"))
        self.overlap = gui.add_checkbox("Regions may overlap", False)
        panel.on(self.new.on_click, lambda _: self._new())
        panel.on(self.name.on_update, lambda said: self._rename(said.value))
        panel.on(self.colour.on_update, lambda said: self._recolour(said.value))
        panel.on(self.radius.on_update, lambda said: self._radius(said.value))
        panel.on(self.erase.on_update, lambda said: self._set(erase=said.value))
        panel.on(self.through.on_update, lambda said: self._set(through=said.value))
        panel.on(self.history.on_click, lambda said: self._history(said.value))
        panel.on(self.more.on_click, lambda said: self._more(said.value))
        panel.on(self.overlap.on_update, lambda said: self._overlap(said.value))

    def refresh(self) -> None:
        """The region that is painted now."""
        studio = self.studio
        region = studio.editor.document.region(studio.region)
        self.panel.set_value(self.radius, int(np.clip(round(1e3 * studio.radius_m), 5, 500)))
        self.panel.set_value(self.overlap, studio.editor.document.allow_overlap)
        if region is None:
            self.status.content = "There is no region yet."
            return
        self.panel.set_value(self.name, region.name)
        self.panel.set_value(self.colour, region.colour)
        count, share = int(region.mask.sum()), float(region.mask.mean())
        lines = [f"**{region.name}**: {count} points, {share:.1%} of the object."]
        shared = [] if studio.editor.document.allow_overlap else studio.editor.shared()
        lines += [f"⚠ {line.split(';')[0]}: the dark points." for line in shared]
        self.status.content = "  \n".join(lines)

    def _new(self) -> None:
        if self.studio.editor.document.reference is None:
            raise RegionError("there is no object to paint on: open one in step 1")
        self.studio.region = self.studio.editor.add_region()
        self.studio.step = 0
        if self.studio.mouse.tool == "Turn":
            self.studio.mouse.take("Grow")
        self.studio.sync()

    def _rename(self, name: str) -> None:
        self.studio.need_region()
        try:
            self.studio.editor.rename_region(self.studio.region, name)
            self.studio.region = name.strip()
        finally:
            self.studio.sync()
        self.studio.plan()

    def _recolour(self, colour: tuple[int, int, int]) -> None:
        self.studio.need_region()
        self.studio.editor.recolour_region(self.studio.region, colour)
        self.studio.draw()

    def _radius(self, millimetres: float) -> None:
        self.studio.mouse.regrow(1e-3 * millimetres)

    def _set(self, **choices: bool) -> None:
        for name, value in choices.items():
            setattr(self.studio.mouse, name, value)

    def _overlap(self, allowed: bool) -> None:
        self.studio.editor.allow_overlap(allowed)
        self.refresh()

    def _history(self, which: str) -> None:
        if which == "Undo":
            self.panel.undo()
        else:
            self.panel.redo()

    def _more(self, which: str) -> None:
        studio = self.studio
        studio.need_region()
        mask: Any = studio.editor.mask(REFERENCE, studio.region)
        if which == "Delete":
            studio.editor.remove_region(studio.region)
        elif which == "Clear":
            studio.editor.paint(REFERENCE, studio.region, np.zeros_like(mask))
        else:
            other = studio.editor.paintable(REFERENCE).canvas.mirrored(mask)
            studio.editor.paint(REFERENCE, studio.region, mask | other)
        studio.mouse.forget()
        studio.sync()
        studio.plan()
