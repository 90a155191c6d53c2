"""Step 1: the object that the process is taught on."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from nrdf.bundled import KNOWLEDGE, REFERENCE
from nrdf.geometry.units import METRES
from nrdf.process.bound_knowledge import read_bound_knowledge
from nrdf.studio.model.uploads import BUNDLED, ENDINGS, bundled

if TYPE_CHECKING:
    from nrdf.io.cloud import PointCloud
    from nrdf.studio.panels.panel import Panel, PanelEvent

AS_IN_FILE = "as the file says"
TAUGHT = "chair with its five processes"


class ObjectTab:
    """Load a reference: one of the package's, or a file."""

    def __init__(self, panel: Panel) -> None:
        self.panel, self.studio = panel, panel.studio
        gui = self.studio.server.gui
        known = self.studio.categories
        first = "chair" if "chair" in known else known[0]
        gui.add_markdown("Open the object that you teach on. It faces +X, with +Y up.")
        self.bundled = gui.add_dropdown("Bundled chair", (*BUNDLED, TAUGHT))
        self.open = gui.add_button("Open the bundled chair", icon=None)
        gui.add_markdown("Or a scan or mesh of your own:")
        self.category = gui.add_dropdown("It is a", self.studio.categories, initial_value=first)
        self.unit = gui.add_dropdown("Its unit is", (AS_IN_FILE, *METRES))
        self.upload = gui.add_upload_button(
            "Load a file …", mime_type=",".join(ENDINGS), hint=f"{', '.join(ENDINGS)}"
        )
        self.status = gui.add_markdown("")
        self.anew = gui.add_button("Start anew", color="gray")
        panel.on(self.open.on_click, lambda _: self._open())
        panel.on(self.upload.on_upload, lambda said: self._load(said.value))
        panel.on(self.anew.on_click, self._ask)

    def refresh(self) -> None:
        """What the reference is."""
        reference = self.studio.editor.document.reference
        if reference is None:
            self.status.content = "Nothing is open yet."
            return
        size = reference.cloud.points.max(axis=0) - reference.cloud.points.min(axis=0)
        sides = " × ".join(f"{1e3 * side:.0f}" for side in size)
        self.status.content = (
            f"**{reference.name}**, a {self.studio.editor.document.category}: "
            f"{len(reference.cloud)} points, {sides} mm. Everything you do is saved at once."
        )

    def _open(self) -> None:
        name = self.bundled.value
        if name == TAUGHT:
            self.studio.editor.open_knowledge(REFERENCE, read_bound_knowledge(KNOWLEDGE))
        else:
            self.studio.editor.open_reference(name, bundled(name), "chair")
        self.studio.restore()

    def _load(self, file: Any) -> None:
        category = self.category.value

        def opened(cloud: PointCloud) -> None:
            self.studio.editor.open_reference(file.name, cloud, category)
            self.studio.restore()

        self.studio.read(file, category, unit_of(self.unit.value), opened)

    def _ask(self, said: PanelEvent) -> None:
        gui = self.studio.server.gui
        with gui.add_modal("Start anew?") as modal:
            gui.add_markdown(
                "Object, regions, processes and targets are put away. *Undo* (Ctrl+Z) brings them "
                "back as long as the studio runs; what was saved in step 5 stays."
            )
            yes = gui.add_button("Start anew", color="red")
            no = gui.add_button("Go on with this", color="gray")

        def anew(_: Any) -> None:
            modal.close()
            self.studio.editor.start_anew()
            self.studio.restore()

        self.panel.on(yes.on_click, anew)
        self.panel.on(no.on_click, lambda _: modal.close())


def unit_of(shown: str) -> str | None:
    """The unit that was chosen, None for the file's own."""
    return None if shown == AS_IN_FILE else shown
