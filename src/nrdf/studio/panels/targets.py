"""Step 4: other objects, what arrives on them, and how sure it is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from nrdf.errors import NrdfError
from nrdf.geometry.units import METRES
from nrdf.process.limits import LOW_CONFIDENCE, Limits
from nrdf.reports.transfer_report import report_of, shares_in_words
from nrdf.studio.model.uploads import BUNDLED, ENDINGS, bundled
from nrdf.studio.panels.object import AS_IN_FILE, unit_of
from nrdf.studio.scene.colours import COLOURINGS

if TYPE_CHECKING:
    from nrdf.studio.panels.panel import Panel

ALL = "all of them"


class TargetsTab:
    """Add objects, bring the processes there, look at the result."""

    def __init__(self, panel: Panel) -> None:
        self.panel, self.studio = panel, panel.studio
        gui = self.studio.server.gui
        gui.add_markdown("Add other objects of the kind, and bring the process there.")
        self.bundled = gui.add_dropdown("Bundled chair", (*BUNDLED[1:], ALL))
        self.add = gui.add_button("Add the bundled chair")
        self.unit = gui.add_dropdown("A file's unit", (AS_IN_FILE, *METRES))
        self.upload = gui.add_upload_button("Add a file …", mime_type=",".join(ENDINGS))
        self.bring = gui.add_button("Bring the process there", color="green")
        self.status = gui.add_markdown("")
        self.shown = gui.add_dropdown("Beside the reference", (ALL,))
        self.colours = gui.add_dropdown(
            "Colours", COLOURINGS,
            hint="regions: paler where less sure. confidence: green sure, red in doubt.",
        )  # fmt: skip
        self.width = gui.add_slider(
            "Likeness reaches", 0.02, 0.6, 0.01, 0.15,
            hint="How far a point may be from like the one clicked with Alike, and still light up.",
        )  # fmt: skip
        self.more = gui.add_button_group("This target", ("Forget my painting", "Remove"))
        panel.on(self.add.on_click, lambda _: self._add(self.bundled.value))
        panel.on(self.upload.on_upload, lambda said: self._load(said.value))
        panel.on(self.bring.on_click, lambda _: self._bring())
        panel.on(self.shown.on_update, lambda said: self._show(said.value))
        panel.on(self.colours.on_update, lambda _: self._recolour())
        panel.on(self.width.on_update, lambda _: self._recolour())
        panel.on(self.more.on_click, lambda said: self._more(said.value))

    def refresh(self) -> None:
        """Every target's result."""
        studio = self.studio
        keys = studio.editor.object_keys()[1:]
        self.panel.set_options(self.shown, (ALL, *keys))
        self.panel.set_value(self.shown, studio.beside if studio.beside in keys else ALL)
        self.panel.set_value(self.colours, studio.colouring)
        self.status.content = "\n\n".join(self._about(key) for key in keys) or "No target yet."

    def _about(self, key: str) -> str:
        studio = self.studio
        result = studio.results.by_target.get(key)
        if result is None:
            return f"**{key}**: waits for *Bring the process there*."
        report = report_of(result.transfer_result, Limits())
        old = "" if studio.results.is_current(key) else " *(of before your last change)*"
        minutes, seconds = divmod(round(report["total"]["cycle_time_s"]), 60)
        count = report["total"]["paths"]
        paths = "1 tool path" if count == 1 else f"{count} tool paths"
        head = f"**{key}**{old}: {paths}, {minutes} min {seconds} s"
        rows = ["| region | process | sure | worked · left out · unreached |", "|---|---|---|---|"]
        for path in report["paths"]:
            region = report["regions"][path["region"]]
            confidence = region["confidence"]
            doubted = not region["found"] or confidence < LOW_CONFIDENCE
            covered = shares_in_words(path["metrics"]) if path["planned"] else "–"
            flag = "⚠ " if doubted else ""
            rows.append(
                f"| {flag}{path['region']} | {path['process']} | {confidence:.2f} | {covered} |"
            )
        notes = [f"⚠ {warning}" for warning in report["warnings"]]
        return "\n".join([head, "", *rows, "", *(f"{note}  " for note in notes)])

    def _add(self, chosen: str) -> None:
        for name in BUNDLED[1:] if chosen == ALL else (chosen,):
            self._added(name, bundled(name))

    def _load(self, file: Any) -> None:
        self._need_reference()
        category, unit = self.studio.editor.document.category, unit_of(self.unit.value)
        self.studio.read(file, category, unit, lambda cloud: self._added(file.name, cloud))

    def _need_reference(self) -> None:
        if self.studio.editor.document.reference is None:
            raise NrdfError("there is no reference yet: open one in step 1 first")

    def _added(self, name: str, cloud: Any) -> None:
        self._need_reference()
        self.studio.editor.add_target(name, cloud)
        self.studio.beside = None
        self.studio.sync()

    def _bring(self) -> None:
        if not self.studio.editor.document.targets:
            raise NrdfError("there is no target yet: add one above")
        regions = self.studio.editor.document.regions
        bare = ", ".join(region.name for region in regions if not region.mask.any())
        if bare and any(region.mask.any() for region in regions):
            self.studio.notify(
                "Left out", f"{bare}: no points yet; paint them in step 2, or delete them there"
            )
        self.studio.transfer()

    def _show(self, shown: str) -> None:
        self.studio.beside = None if shown == ALL else shown
        self.studio.arrange()

    def _recolour(self) -> None:
        self.studio.recolour(self.colours.value, float(self.width.value))

    def _more(self, which: str) -> None:
        key = self.studio.beside
        keys = self.studio.editor.object_keys()[1:]
        if key is None and len(keys) == 1:
            key = keys[0]
        if key is None or key not in keys:
            raise NrdfError("choose a target under 'Beside the reference' first")
        if which == "Remove":
            self.studio.editor.remove_target(key)
            self.studio.beside = None
        else:
            self.studio.editor.forget_corrections(key)
            self.studio.transfer()
        self.studio.sync()
