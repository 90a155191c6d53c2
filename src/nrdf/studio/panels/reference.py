"""Step 1: the object that the process is taught on."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from nrdf.bundled import KNOWLEDGE, REFERENCE
from nrdf.errors import ProcessError
from nrdf.field.general import GENERAL
from nrdf.field.registration import REGISTRATION
from nrdf.field.zoo import list_models
from nrdf.geometry.units import METRES
from nrdf.process.bound_knowledge import read_bound_knowledge
from nrdf.process.model_choice import choose_model
from nrdf.studio.context import StudioContext
from nrdf.studio.file_reading import read_knowledge, read_object
from nrdf.studio.model.document import Document
from nrdf.studio.model.uploads import BUNDLED, ENDINGS, bundled
from nrdf.studio.panels.inputs import Inputs, PanelEvent

if TYPE_CHECKING:
    from nrdf.io.cloud import PointCloud
    from nrdf.process.bound_knowledge import BoundKnowledge

AS_IN_FILE = "as in the file"
OTHER_KIND = "another kind …"
OF_THE_CATEGORY = "the category's own"
WITH_KNOWLEDGE = "chair with its five processes"


class ReferenceTab:
    """Load a reference: one of the package's, or a file."""

    def __init__(self, context: StudioContext, inputs: Inputs) -> None:
        self.context, self.inputs = context, inputs
        gui, known = context.server.gui, context.categories
        first = "chair" if "chair" in known else known[0]
        gui.add_markdown(
            "Open the reference: the object that the process is taught on. It faces +X, +Y is up."
        )
        self.bundled = gui.add_dropdown("Bundled chair", (*BUNDLED, WITH_KNOWLEDGE))
        self.open = gui.add_button("Open the bundled chair", icon=None)
        gui.add_markdown("Or a scan or mesh of your own:")
        self.category = gui.add_dropdown("Category", (*known, OTHER_KIND), initial_value=first)
        self.kind = gui.add_text("Its kind", "", visible=False)
        self.model = gui.add_dropdown("Model", (OF_THE_CATEGORY, GENERAL, REGISTRATION))
        self.unit = gui.add_dropdown("Unit", (AS_IN_FILE, *METRES))
        self.upload = gui.add_upload_button(
            "Load a file …", mime_type=",".join(ENDINGS), hint=f"{', '.join(ENDINGS)}"
        )
        self.knowledge = gui.add_upload_button(
            "Open knowledge …", mime_type=".zip",
            hint="knowledge.zip of step 5, or a ZIP of a knowledge file and what it names.",
        )  # fmt: skip
        self.status = gui.add_markdown("")
        self.new = gui.add_button("New session", color="gray")
        inputs.on(self.category.on_update, lambda _: self._show_kind())
        inputs.on(self.open.on_click, lambda _: self._open())
        inputs.on(self.upload.on_upload, lambda event: self._load(event.value))
        inputs.on(self.knowledge.on_upload, lambda event: self._load_knowledge(event.value))
        inputs.on(self.new.on_click, self._ask)

    def refresh(self) -> None:
        """Show the reference."""
        document = self.context.editor.document
        reference = document.reference
        if reference is None:
            self.status.content = "No reference is open."
            return
        size = reference.cloud.points.max(axis=0) - reference.cloud.points.min(axis=0)
        sides = " × ".join(f"{1e3 * side:.0f}" for side in size)
        self.status.content = (
            f"**{reference.name}**, category {document.category}: {len(reference.cloud)} points, "
            f"{sides} mm. " + _about_model(document) + "Every change is saved at once."
        )

    def _open(self) -> None:
        name, editor = self.bundled.value, self.context.editor
        if name == WITH_KNOWLEDGE:
            editor.open_knowledge(REFERENCE, read_bound_knowledge(KNOWLEDGE))
        else:
            editor.open_reference(name, bundled(name), "chair")
        self.context.restore()

    def _load(self, file: Any) -> None:
        category = self._category()
        given = None if self.model.value == OF_THE_CATEGORY else self.model.value
        chosen = choose_model(category, given).name  # asks back where the kind looks misspelt
        model = None if chosen == category else chosen

        def opened(cloud: PointCloud) -> None:
            self.context.editor.open_reference(file.name, cloud, category, model)
            self.context.restore()

        read_object(self.context, file, category, unit_of(self.unit.value), opened)

    def _load_knowledge(self, file: Any) -> None:
        def opened(bound: BoundKnowledge) -> None:
            self.context.editor.open_knowledge(bound.knowledge.reference.cloud or REFERENCE, bound)
            self.context.restore()

        read_knowledge(self.context, file, opened)

    def _show_kind(self) -> None:
        self.kind.visible = self.category.value == OTHER_KIND

    def _category(self) -> str:
        """The category that was chosen, or the kind that was typed."""
        if self.category.value != OTHER_KIND:
            return str(self.category.value)
        kind = " ".join(self.kind.value.split())
        if not kind:
            raise ProcessError("say what kind of object it is, in the field 'Its kind'")
        return kind

    def _ask(self, event: PanelEvent) -> None:
        gui = self.context.server.gui
        with gui.add_modal("New session?") as modal:
            gui.add_markdown(
                "Reference, regions, processes and targets are removed. *Undo* (Ctrl+Z) brings "
                "them back as long as the studio runs; what was saved in step 5 stays."
            )
            yes = gui.add_button("New session", color="red")
            no = gui.add_button("Keep this session", color="gray")

        def start(_: Any) -> None:
            modal.close()
            self.context.editor.new_session()
            self.context.restore()

        self.inputs.on(yes.on_click, start)
        self.inputs.on(no.on_click, lambda _: modal.close())


def _about_model(document: Document) -> str:
    """What finds the regions where that is not the category's own model, in a sentence."""
    if document.model not in (GENERAL, REGISTRATION):
        return ""
    finds = "the general model" if document.model == GENERAL else "registration"
    if any(entry.category == document.category for entry in list_models()):
        return f"Regions are found by {finds}. "
    return (
        f"⚠ There is no model for the category '{document.category}': regions are found by "
        f"{finds}, which serves any kind. "
    )


def unit_of(shown: str) -> str | None:
    """The unit that was chosen, None for the file's own."""
    return None if shown == AS_IN_FILE else shown
