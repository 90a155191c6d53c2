"""Step 5: files to take away."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from nrdf.export.registry import FORMATS
from nrdf.reports.job_folder import HTML_REPORT
from nrdf.studio.model.result_cache import TargetResult
from nrdf.studio.model.saving import save_job, save_knowledge, save_picture, save_programs, zipped

if TYPE_CHECKING:
    from nrdf.studio.model.worker import Progress
    from nrdf.studio.panels.panel import Panel, PanelEvent

NO_TARGET = "(none yet)"


class SaveTab:
    """Each button writes into the session's folder, and sends the same to the browser."""

    def __init__(self, panel: Panel) -> None:
        self.panel, self.studio = panel, panel.studio
        gui = self.studio.server.gui
        gui.add_markdown("Take away what you need; the command line reads all of it.")
        self.knowledge = gui.add_button("Knowledge file, with the reference")
        self.picture = gui.add_button("Picture of all objects")
        self.target = gui.add_dropdown("Target", (NO_TARGET,))
        self.job = gui.add_button("Job of this target")
        self.page = gui.add_button("Report as one page")
        self.format = gui.add_dropdown("Robot format", tuple(FORMATS), initial_value="urscript")
        self.programs = gui.add_button("Robot programs of this target")
        self.status = gui.add_markdown("")
        panel.on(self.knowledge.on_click, self._knowledge)
        panel.on(self.picture.on_click, self._picture)
        panel.on(self.job.on_click, lambda said: self._job(said, page=False))
        panel.on(self.page.on_click, lambda said: self._job(said, page=True))
        panel.on(self.programs.on_click, self._programs)

    def refresh(self) -> None:
        """Which targets there are."""
        keys = [
            key
            for key in self.studio.editor.object_keys()[1:]
            if key in self.studio.results.by_target
        ]
        self.panel.set_options(self.target, tuple(keys) or (NO_TARGET,))

    def _knowledge(self, said: PanelEvent) -> None:
        place = save_knowledge(self.studio.editor)
        said.client.send_file_download("knowledge.zip", zipped(place), save_immediately=True)
        self._tell(place, f"nrdf check {next(place.glob('*.yaml'))}")

    def _picture(self, said: PanelEvent) -> None:
        def work(progress: Progress) -> None:
            progress(0, 1)
            place = save_picture(self.studio.editor, self.studio.results)
            content = place.read_bytes()
            said.client.send_file_download("nrdf.png", content, save_immediately=True)
            self._tell(place)

        self.studio.worker.submit("save", "drawing the picture", work)

    def _job(self, said: PanelEvent, page: bool) -> None:
        name, result = self._chosen()

        def work(progress: Progress) -> None:
            progress(0, 1)
            place = save_job(self.studio.editor, name, result, self.studio.origin)
            if page:
                content, file = (place / HTML_REPORT).read_bytes(), f"{name}.html"
            else:
                content, file = zipped(place), f"{name}-job.zip"
            said.client.send_file_download(file, content, save_immediately=True)
            self._tell(
                place / HTML_REPORT if page else place, f"nrdf export {place} --format urscript"
            )

        self.studio.worker.submit("save", "writing the job and its pictures", work)

    def _programs(self, said: PanelEvent) -> None:
        name, result = self._chosen()
        place = save_programs(self.studio.editor, name, result, (self.format.value,))
        file = f"{name}-{self.format.value}.zip"
        said.client.send_file_download(file, zipped(place), save_immediately=True)
        self._tell(place)

    def _chosen(self) -> tuple[str, TargetResult]:
        name = self.target.value
        return name, self.studio.results.ready(name)

    def _tell(self, place: Path, command: str = "") -> None:
        lines = [f"Written to `{place}`."]
        lines += [f"From here: `{command}`"] if command else []
        self.status.content = "  \n".join(lines)
