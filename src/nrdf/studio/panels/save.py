"""Step 5: files to take away."""

from __future__ import annotations

from pathlib import Path

from nrdf.export.registry import FORMATS
from nrdf.reports.job_folder import HTML_REPORT
from nrdf.studio.context import StudioContext
from nrdf.studio.model.result_cache import TargetResult
from nrdf.studio.model.saving import save_job, save_knowledge, save_picture, save_programs, zipped
from nrdf.studio.model.worker import Progress
from nrdf.studio.panels.inputs import Inputs, PanelEvent

NO_TARGET = "(none yet)"


class SaveTab:
    """Each button writes into the session's folder, and sends the same to the browser."""

    def __init__(self, context: StudioContext, inputs: Inputs) -> None:
        self.context, self.inputs = context, inputs
        gui = context.server.gui
        gui.add_markdown("Save what you need; the command line reads all of it.")
        self.knowledge = gui.add_button("Knowledge file, with the reference")
        self.picture = gui.add_button("Picture of all objects")
        self.target = gui.add_dropdown("Target", (NO_TARGET,))
        self.job = gui.add_button("Job of this target")
        self.report = gui.add_button("HTML report of this target")
        self.format = gui.add_dropdown("Robot format", tuple(FORMATS), initial_value="urscript")
        self.programs = gui.add_button("Robot programs of this target")
        self.status = gui.add_markdown("")
        inputs.on(self.knowledge.on_click, self._save_knowledge)
        inputs.on(self.picture.on_click, self._save_picture)
        inputs.on(self.job.on_click, lambda event: self._save_job(event, report_only=False))
        inputs.on(self.report.on_click, lambda event: self._save_job(event, report_only=True))
        inputs.on(self.programs.on_click, self._save_programs)

    def refresh(self) -> None:
        """Show which targets there are."""
        self.inputs.set_options(self.target, transferred_targets(self.context))

    def _save_knowledge(self, event: PanelEvent) -> None:
        folder = save_knowledge(self.context.editor)
        event.client.send_file_download("knowledge.zip", zipped(folder), save_immediately=True)
        self._show(folder, f"nrdf check {next(folder.glob('*.yaml'))}")

    def _save_picture(self, event: PanelEvent) -> None:
        def work(progress: Progress) -> None:
            progress(0, 1)
            path = save_picture(self.context.editor, self.context.results)
            content = path.read_bytes()
            event.client.send_file_download("nrdf.png", content, save_immediately=True)
            self._show(path)

        self.context.worker.submit("save", "drawing the picture", work)

    def _save_job(self, event: PanelEvent, report_only: bool) -> None:
        name, result = self._chosen()

        def work(progress: Progress) -> None:
            progress(0, 1)
            folder = save_job(self.context.editor, name, result, self.context.origin)
            if report_only:
                content, file = (folder / HTML_REPORT).read_bytes(), f"{name}.html"
            else:
                content, file = zipped(folder), f"{name}-job.zip"
            event.client.send_file_download(file, content, save_immediately=True)
            path = folder / HTML_REPORT if report_only else folder
            self._show(path, f"nrdf export {folder} --format urscript")

        self.context.worker.submit("save", "writing the job and its pictures", work)

    def _save_programs(self, event: PanelEvent) -> None:
        name, result = self._chosen()
        folder = save_programs(
            self.context.editor, name, result, (self.format.value,), self.context.cell
        )
        file = f"{name}-{self.format.value}.zip"
        event.client.send_file_download(file, zipped(folder), save_immediately=True)
        self._show(folder)

    def _chosen(self) -> tuple[str, TargetResult]:
        name = self.target.value
        return name, self.context.results.ready(name)

    def _show(self, path: Path, command: str = "") -> None:
        lines = [f"Written to `{path}`."]
        lines += [f"Next: `{command}`"] if command else []
        self.status.content = "  \n".join(lines)


def transferred_targets(context: StudioContext) -> tuple[str, ...]:
    """The targets with a result, as the options of a dropdown."""
    keys = context.editor.object_keys()[1:]
    return tuple(key for key in keys if key in context.results.by_target) or (NO_TARGET,)
