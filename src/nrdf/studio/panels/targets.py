"""Step 4: the targets, the processes that are transferred to them, and their confidence."""

from __future__ import annotations

from typing import Any

from nrdf.errors import NrdfError
from nrdf.geometry.units import METRES
from nrdf.process.limits import LOW_CONFIDENCE, Limits
from nrdf.process.transfer_result import TransferResult
from nrdf.reports.transfer_report import shares_in_words, transfer_report
from nrdf.studio.context import StudioContext
from nrdf.studio.file_reading import read_object, read_scan
from nrdf.studio.model.placing import PlacedScan
from nrdf.studio.model.uploads import BUNDLED, ENDINGS, bundled
from nrdf.studio.panels.inputs import Inputs
from nrdf.studio.panels.reference import AS_IN_FILE, unit_of
from nrdf.studio.panels.standing import StandingFolder
from nrdf.studio.scene.colours import COLOURINGS, RESULT
from nrdf.studio.scene.result_map import result_legend

ALL = "all of them"
STANDS = ("in any pose", "+X forward, +Y up")


class TargetsTab:
    """Add targets, transfer the processes, look at the result."""

    def __init__(self, context: StudioContext, inputs: Inputs) -> None:
        self.context, self.inputs = context, inputs
        gui = context.server.gui
        gui.add_markdown("Add other objects of the category, and transfer the process to them.")
        self.bundled = gui.add_dropdown("Bundled chair", (*BUNDLED[1:], ALL))
        self.add = gui.add_button("Add the bundled chair")
        self.unit = gui.add_dropdown("Unit of a file", (AS_IN_FILE, *METRES))
        self.stands = gui.add_dropdown(
            "It stands", STANDS, hint="A scan in any pose is cleaned, and its pose is proposed."
        )
        self.upload = gui.add_upload_button("Add a file …", mime_type=",".join(ENDINGS))
        self.standing = StandingFolder(context, inputs)
        self.transfer = gui.add_button("Transfer the process", color="green")
        self.status = gui.add_markdown("")
        self.shown = gui.add_dropdown("Beside the reference", (ALL,))
        self.colours = gui.add_dropdown(
            "Colours", COLOURINGS,
            hint="regions: paler where the confidence is lower. confidence: green 1, red 0. "
            "similarity: of the descriptors to the picked point. film or depth: what the processes "
            "will leave; blue too little, red too much.",
        )  # fmt: skip
        self.legend = gui.add_html("", visible=False)
        self.width = gui.add_slider(
            "Similarity width", 0.02, 0.6, 0.01, 0.15,
            hint="Descriptor distance to the picked point at which the colour fades.",
        )  # fmt: skip
        self.more = gui.add_button_group("This target", ("Discard corrections", "Remove"))
        inputs.on(self.add.on_click, lambda _: self._add(self.bundled.value))
        inputs.on(self.upload.on_upload, lambda event: self._load(event.value))
        inputs.on(self.transfer.on_click, lambda _: self._transfer())
        inputs.on(self.shown.on_update, lambda event: self._show(event.value))
        inputs.on(self.colours.on_update, lambda _: self._recolour())
        inputs.on(self.width.on_update, lambda _: self._recolour())
        inputs.on(self.more.on_click, lambda event: self._more(event.value))

    def refresh(self) -> None:
        """Show every target's result."""
        context, inputs = self.context, self.inputs
        keys = context.editor.object_keys()[1:]
        inputs.set_options(self.shown, (ALL, *keys))
        shown = context.shown_target
        inputs.set_value(self.shown, shown if shown in keys else ALL)
        inputs.set_value(self.colours, context.colouring)
        self.standing.refresh()
        visible = context.visible_objects() if context.colouring == RESULT else []
        left_on = context.results.left_on
        self.legend.content = "".join(result_legend(key, left_on(key)) for key in visible)
        self.legend.visible = bool(self.legend.content)
        self.status.content = "\n\n".join(self._about(key) for key in keys) or "No target yet."

    def _about(self, key: str) -> str:
        results = self.context.results
        if key not in results.by_target:
            return f"**{key}**: press *Transfer the process*."
        return about_result(
            key, results.by_target[key].transfer_result, current=results.is_current(key)
        )

    def _add(self, chosen: str) -> None:
        for name in BUNDLED[1:] if chosen == ALL else (chosen,):
            self._add_cloud(name, bundled(name))

    def _load(self, file: Any) -> None:
        self._need_reference()
        category, unit = self.context.editor.document.category, unit_of(self.unit.value)
        if self.stands.value == STANDS[0]:
            read_scan(self.context, file, unit, lambda placed: self._add_scan(file.name, placed))
        else:
            read_object(
                self.context, file, category, unit, lambda cloud: self._add_cloud(file.name, cloud)
            )

    def _need_reference(self) -> None:
        if self.context.editor.document.reference is None:
            raise NrdfError("there is no reference yet: open one in step 1 first")

    def _add_cloud(self, name: str, cloud: Any) -> None:
        self._need_reference()
        self.context.editor.add_target(name, cloud)
        self.context.shown_target = None
        self.context.sync()

    def _add_scan(self, name: str, placed: PlacedScan) -> None:
        self._need_reference()
        self.context.editor.add_target(name, placed.cloud, placed)
        self.context.shown_target = None
        self.context.sync()

    def _transfer(self) -> None:
        document = self.context.editor.document
        if not document.targets:
            raise NrdfError("there is no target yet: add one above")
        empty = ", ".join(region.name for region in document.regions if not region.mask.any())
        if empty and any(region.mask.any() for region in document.regions):
            self.context.notify(
                "Left out", f"{empty}: no points yet; paint them in step 2, or delete them there"
            )
        self.context.transfer()

    def _show(self, shown: str) -> None:
        self.context.show_target(None if shown == ALL else shown)

    def _recolour(self) -> None:
        results, keys = self.context.results, self.context.editor.object_keys()
        if self.colours.value == RESULT and not any(results.left_on(key) for key in keys):
            raise NrdfError(
                "no process says what it should leave: give one thickness_um or removal_um in its "
                "knowledge file, and open it in step 1"
            )
        self.context.recolour(self.colours.value, float(self.width.value))
        self.refresh()

    def _more(self, which: str) -> None:
        context, key = self.context, self.context.shown_target
        keys = context.editor.object_keys()[1:]
        if key is None and len(keys) == 1:
            key = keys[0]
        if key is None or key not in keys:
            raise NrdfError("choose a target under 'Beside the reference' first")
        if which == "Remove":
            context.editor.remove_target(key)
            context.shown_target = None
        else:
            context.editor.discard_corrections(key)
            context.transfer()
        context.sync()


def about_result(key: str, result: TransferResult, current: bool) -> str:
    """A target's tool paths and regions with their confidence, in Markdown."""
    report = transfer_report(result, Limits())
    outdated = "" if current else " *(of before your last change)*"
    minutes, seconds = divmod(round(report["total"]["cycle_time_s"]), 60)
    count = report["total"]["paths"]
    paths = "1 tool path" if count == 1 else f"{count} tool paths"
    head = f"**{key}**{outdated}: {paths}, {minutes} min {seconds} s"
    rows = [
        "| region | process | confidence | worked · left out · unreached |",
        "|---|---|---|---|",
    ]
    for path in report["paths"]:
        region = report["regions"][path["region"]]
        confidence = region["confidence"]
        uncertain = not region["found"] or confidence < LOW_CONFIDENCE
        covered = shares_in_words(path["metrics"]) if path["planned"] else "–"
        flag = "⚠ " if uncertain else ""
        rows.append(
            f"| {flag}{path['region']} | {path['process']} | {confidence:.2f} | {covered} |"
        )
    notes = [f"⚠ {warning}" for warning in report["warnings"]]
    return "\n".join([head, "", *rows, "", *(f"{note}  " for note in notes)])
