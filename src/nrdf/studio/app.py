"""The page: a editor, a results and a stage, brought together for everyone who has it open."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np
import viser

from nrdf.errors import NrdfError
from nrdf.studio.arm_simulation import ArmSimulation
from nrdf.studio.model.computing import (
    ChildProcessComputing,
    CorrespondenceFeatures,
    LocalComputing,
)
from nrdf.studio.model.document import REFERENCE
from nrdf.studio.model.editor import Editor
from nrdf.studio.model.result_cache import ResultCache
from nrdf.studio.model.session import Session
from nrdf.studio.model.teaching import ORIGIN
from nrdf.studio.model.uploads import check_upload, shown_name
from nrdf.studio.model.worker import Progress, Worker
from nrdf.studio.mouse import Mouse
from nrdf.studio.panels.panel import Activity, Panel
from nrdf.studio.scene.colours import COLOURINGS, similarity_colours
from nrdf.studio.scene.drawing import colours_of, direction_of, lines_of, title_of
from nrdf.studio.scene.scene_view import ObjectView, SceneView

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from nrdf.io.cloud import PointCloud

log = logging.getLogger(__name__)

_PLAN_AFTER_S = 0.4
_ASPECT = 1.2  # width over height of a page that is not open yet
_PATCH = 0.08  # first radius of a patch, in sides of the object


class Studio:
    """Everything between browsers and a session; all that are connected see the same.

    server: a viser server with nothing on it yet. computing: what plans and transfers, for objects
    of one of `categories`. origin: what reports say of how they were made. robot, tool_frame: the
    arm of simulations, the bundled one unless given.
    """

    def __init__(
        self,
        session: Session,
        server: viser.ViserServer,
        computing: LocalComputing | ChildProcessComputing,
        categories: Sequence[str],
        origin: Mapping[str, Any],
        robot: Path | None = None,
        tool_frame: str | None = None,
    ) -> None:
        self.server, self.categories, self.origin = server, tuple(categories), origin
        self.editor = Editor(session)
        self.results = ResultCache(self.editor, computing)
        self.scene = SceneView(server)
        self.lock = threading.RLock()
        self.region, self.step, self.radius_m = "", 0, 0.05
        self.colouring, self.width = COLOURINGS[0], 0.15
        self.beside: str | None = None
        """The one target that is shown beside the reference, None for all."""
        self._distances: dict[str, np.ndarray] = {}
        self._described: CorrespondenceFeatures | None = None
        self._pointed = self._uploads = 0
        self.mouse = Mouse(self)
        self.panel = Panel(self)
        working = self.panel.working
        self.worker = Worker(working.started, working.progress, self.ended(working))
        self.arm_simulation = ArmSimulation(self, robot, tool_frame)
        server.on_client_connect(self._welcome)
        self.restore()
        if session.damage:
            self.panel.show_error(f"⚠ **The session was damaged**: {session.damage}")

    # --- what is shown

    def restore(self) -> None:
        """Show the session from the beginning, and compute what it needs."""
        with self.lock:
            document = self.editor.document
            self.worker.cancel()
            self.arm_simulation.worker.cancel()
            self.arm_simulation.clear()
            self.scene.clear(1.0)
            self.results.by_target.clear()
            self._distances.clear()
            self._described = None
            self.mouse.forget()
            self.region, self.step, self.beside = "", 0, None
            self.sync()
            if document.regions:
                self.plan(0.0)
            if any(region.mask.any() for region in document.regions) and document.targets:
                self.transfer()

    def sync(self) -> None:
        """Bring stage and panel to what the document says."""
        with self.lock:
            document, keys = self.editor.document, self.editor.object_keys()
            # Another reference, or none any more, is another stage.
            standing = self.scene.objects.get(REFERENCE)
            if standing is not None and (
                REFERENCE not in keys or standing.paintable is not self.editor.paintable(REFERENCE)
            ):
                self.scene.clear(1.0)
            if REFERENCE in keys and REFERENCE not in self.scene.objects:
                paintable = self.editor.paintable(REFERENCE)
                side = float((paintable.high - paintable.low).max())
                self.scene.clear(1.0 / side)
                self.radius_m = _PATCH * side
            gone = [key for key in self.scene.objects if key not in keys]
            new = [key for key in keys if key not in self.scene.objects]
            for key in gone:
                self.scene.remove(key)
                self.results.by_target.pop(key, None)
            for key in new:
                self.scene.add(key, self.editor.paintable(key))
            painted = document.region(self.region)
            if painted is None:
                painted = document.regions[-1] if document.regions else None
                self.region, self.step = ("" if painted is None else painted.name), 0
            self.step = min(self.step, len(painted.steps) - 1) if painted else 0
            self.arm_simulation.check()
            if gone or new:
                self.arrange()
            self.mouse.grip()
            self.draw()
            self.panel.refresh()

    def shown(self) -> list[str]:
        """The objects that are to be seen: with an arm, the one that it works on."""
        if self.arm_simulation.shown:
            return [self.arm_simulation.key]
        keys = self.editor.object_keys()
        return [k for k in keys if k == REFERENCE or self.beside is None or k == self.beside]

    def arrange(self) -> None:
        """Let what is to be seen stand side by side, and every camera see all of it."""
        shown = self.shown()
        self.scene.arrange(shown)
        self.arm_simulation.follow()
        beside = self.arm_simulation.places
        place, middle = self.scene.camera(shown, _ASPECT, beside)
        initial = self.server.initial_camera
        initial.position, initial.look_at = tuple(place), tuple(middle)
        for client in self.server.get_clients().values():
            place, middle = self.scene.camera(shown, client.camera.aspect, beside)
            with client.atomic():
                client.camera.position = place
                client.camera.look_at = middle

    def draw(self) -> None:
        """Colours, lines, names and the arrow, of all objects."""
        with self.lock, self.server.atomic():
            for key, object_view in self.scene.objects.items():
                self.draw_colours(object_view)
                lines = {} if self._alike(object_view) else lines_of(self.editor, self.results, key)
                object_view.draw_lines(lines)
                object_view.name(title_of(self.editor, self.results, key))
            if REFERENCE in self.scene.objects:
                ends = direction_of(self.editor, self.region, self.step)
                self.scene.objects[REFERENCE].draw_arrow("direction", *(ends or (None, None)))

    def draw_colours(self, object_view: ObjectView) -> None:
        """The colours of one object."""
        if self._alike(object_view):
            object_view.paint(similarity_colours(self._distances[object_view.key], self.width))
        else:
            by_confidence = self.colouring == "confidence"
            object_view.paint(colours_of(self.editor, self.results, object_view.key, by_confidence))

    def recolour(self, colouring: str, width: float) -> None:
        """Colour by something else, or another width of likeness.

        Raises NrdfError for likeness where no point has been asked for.
        """
        with self.lock:
            if colouring == "likeness" and not self._distances:
                raise NrdfError("take 'Alike' and click a point of the reference first")
            self.colouring, self.width = colouring, width
            self.draw()

    def descriptor_distances(self, key: str) -> np.ndarray | None:
        """How far an object's shown points (k,) are from the place that was pointed at, if any."""
        return self._distances.get(key)

    def _alike(self, object_view: ObjectView) -> bool:
        return self.colouring == "likeness" and object_view.key in self._distances

    def painted(self) -> None:
        """What follows a change of regions: lines that no longer hold go, and new ones come."""
        if self.colouring == "likeness":
            self.colouring = COLOURINGS[0]
        self.draw()
        self.panel.refresh()
        self.plan()
        current = self.results.is_current
        if any(t.corrected and not current(t.object.name) for t in self.editor.document.targets):
            self.transfer(_PLAN_AFTER_S)

    # --- long work

    def plan(self, delay_s: float = _PLAN_AFTER_S) -> None:
        """Plan on the reference what is not planned yet, in the background."""
        document = self.editor.document
        self._later("plan", "planning on the reference", delay_s,
                    lambda progress: self.results.make_plans(document, progress))  # fmt: skip

    def transfer(self, delay_s: float = 0.0) -> None:
        """Bring the processes to the targets, in the background."""
        document = self.editor.document
        self._later("transfer", "finding regions and planning tool paths", delay_s,
                    lambda progress: self.results.transfer(document, progress))  # fmt: skip

    def read(
        self, file: Any, category: str, unit: str | None, then: Callable[[PointCloud], None]
    ) -> None:
        """Read a file that a browser sent, in the background, and give its cloud to `then`.

        Raises CloudError for a file of another type, or too large a one.
        """
        name, content = file.name, file.content
        check_upload(name, len(content))

        def work(progress: Progress) -> None:
            cloud = self.results.read(name, content, category, unit, progress)
            with self.lock:
                then(cloud)

        self._uploads += 1  # each is a job of its own
        self._later(f"read {self._uploads}", f"reading {shown_name(name)}", 0.0, work)

    def compare(self, key: str, index: int) -> None:
        """Colour every object by how alike its points are to a shown point of the reference: in
        the background the first time, at once while the mouse goes on from there."""
        if key != REFERENCE:
            raise NrdfError("point at the reference: what is like that place lights up elsewhere")
        self._pointed = index
        if self._described is not None and self.colouring == "likeness":
            self._distances = self._described.distances(index)
            for object_view in self.scene.objects.values():
                self.draw_colours(object_view)
            return
        document = self.editor.document

        def work(progress: Progress) -> None:
            described = self.results.described(document, progress)
            with self.lock:
                self._described = described
                self._distances, self.colouring = described.distances(self._pointed), "likeness"

        if self._described is not None or not self.worker.has_job("likeness"):
            self._described = None
            self._later("likeness", "comparing descriptors", 0.0, work)

    def _later(
        self, kind: str, what: str, delay_s: float, work: Callable[[Progress], None]
    ) -> None:
        """Work in the background, then show what it has made, however it ended."""

        def then_show(progress: Progress) -> None:
            try:
                work(progress)
            finally:
                with self.lock:
                    if kind != "likeness":
                        self._described = None  # of what there was before
                    self.draw()
                    self.panel.refresh()

        self.worker.submit(kind, what, then_show, delay_s)

    def ended(self, activity: Activity) -> Callable[[str, str], None]:
        """What a worker calls when a job has ended: (what it was, error or "")."""

        def end(what: str, error: str) -> None:
            activity.ended()
            if error == "cancelled":
                self.notify(what, "cancelled; what was finished is kept", bad=False)
            elif error:
                self.notify(what, error)

        return end

    def stop(self) -> None:
        """End all that runs beside the page."""
        self.worker.stop()
        self.results.stop()
        self.arm_simulation.stop()

    # --- talking

    def need_region(self) -> None:
        """Raises NrdfError where there is no region to work on."""
        if self.editor.document.region(self.region) is None:
            raise NrdfError("there is no region yet: press 'New region' in step 2 first")

    @contextmanager
    def reporting_errors(self) -> Iterator[None]:
        """A block that holds the lock; what goes wrong in it is said on the page."""
        with self.lock:
            self.panel.show_error("")
            try:
                yield
            except NrdfError as error:
                self.panel.refresh()
                self.notify("That did not work", str(error))
            except Exception as error:
                log.exception("a fault of the studio")
                self.notify("A fault of nrdf", f"{type(error).__name__}: {error}")

    def notify(self, title: str, body: str, bad: bool = True) -> None:
        """A notification on every open page; what is bad stays in the panel until the next act."""
        body = body.removeprefix(f"{ORIGIN}: ")
        if bad:
            self.panel.show_error(f"⚠ **{title}**: {body}")
        for client in self.server.get_clients().values():
            client.add_notification(
                title, body, color="red" if bad else "teal", auto_close_seconds=15 if bad else 6
            )

    def _welcome(self, client: viser.ClientHandle) -> None:
        session = self.editor.session
        if session.restored and self.editor.document.reference is not None:
            said = f"as you left it, from the folder {session.folder.name}"
            client.add_notification("Your session is here", said, auto_close_seconds=8)
