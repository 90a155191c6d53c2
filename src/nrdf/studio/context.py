"""What mouse, arm simulation and panels share: the session, its results, the scene, the selection.

They import this module; `nrdf.studio.app` imports them.
"""

from __future__ import annotations

import logging
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
import viser

from nrdf.errors import NrdfError
from nrdf.studio.model.computed import CorrespondenceFeatures
from nrdf.studio.model.computing import (
    ChildProcessComputing,
    LocalComputing,
)
from nrdf.studio.model.document import REFERENCE
from nrdf.studio.model.editor import Editor
from nrdf.studio.model.result_cache import ResultCache
from nrdf.studio.model.session import Session
from nrdf.studio.model.studio_cell import StudioCell
from nrdf.studio.model.teaching import ORIGIN
from nrdf.studio.model.worker import Progress, Worker
from nrdf.studio.pen import Pen
from nrdf.studio.scene.colours import COLOURINGS, RESULT, similarity_colours
from nrdf.studio.scene.drawing import (
    colours_of,
    direction_of,
    doubts_of,
    lines_of,
    region_meshes_of,
    title_of,
)
from nrdf.studio.scene.object_view import ObjectView
from nrdf.studio.scene.result_map import draw_result
from nrdf.studio.scene.scene_view import SceneView

log = logging.getLogger(__name__)

_PLAN_AFTER_S, _PLAN_AFTER_LOOK_S = 0.15, 0.4


class StudioContext(ABC):
    """The state of a studio, its drawing and its background work; the same for every browser.

    server: a viser server with nothing on it yet. computing: what plans and transfers, for objects
    of one of `categories`. origin: what reports say of how they were made. cell: what simulations
    and programs are for.
    """

    worker: Worker
    """Runs plans, transfers and uploads in the background."""

    def __init__(
        self,
        session: Session,
        server: viser.ViserServer,
        computing: LocalComputing | ChildProcessComputing,
        categories: Sequence[str],
        origin: Mapping[str, Any],
        cell: StudioCell,
    ) -> None:
        self.cell = cell
        self.server, self.categories, self.origin = server, tuple(categories), origin
        self.editor = Editor(session)
        self.results = ResultCache(self.editor, computing)
        self.scene = SceneView(server)
        self.lock = threading.RLock()
        self.region, self.step, self.radius_m = "", 0, 0.05
        self.colouring, self.similarity_width = COLOURINGS[0], 0.15
        self.pen = Pen()
        self.shown_target: str | None = None
        """The one target that is shown beside the reference, None for all."""
        self._distances: dict[str, np.ndarray] = {}
        self._features: CorrespondenceFeatures | None = None
        self._picked_point = 0

    # --- what `nrdf.studio.app.Studio` adds

    @abstractmethod
    def restore(self) -> None:
        """Show the session from the beginning. Nothing is computed until a person asks for it."""

    @abstractmethod
    def sync(self) -> None:
        """Bring scene and panel to what the document says."""

    @abstractmethod
    def visible_objects(self) -> list[str]:
        """The keys of the objects that are to be seen."""

    @abstractmethod
    def arrange(self) -> None:
        """Put the visible objects side by side, and let every camera see all of them."""

    @abstractmethod
    def refresh_panel(self) -> None:
        """Show in the panel what the document, the plans and the results say."""

    @abstractmethod
    def show_error(self, text: str) -> None:
        """Show in the panel what went wrong last; "" removes it."""

    def show_target(self, key: str | None) -> None:
        """Show one target beside the reference, or all."""
        self.shown_target = key if key in self.editor.object_keys() else None
        self.arrange()
        self.refresh_panel()

    # --- drawing

    def draw(self) -> None:
        """Draw colours, lines, labels and the direction arrow of all objects."""
        with self.lock, self.server.atomic():
            for key, object_view in self.scene.objects.items():
                self._draw_plans(object_view)
                object_view.set_label(title_of(self.editor, self.results, key))
                unsure, removed = doubts_of(self.editor, key)
                object_view.draw_arrow("front", *(object_view.front if unsure else (None, None)))
                object_view.draw_removed(removed)
            if REFERENCE in self.scene.objects:
                ends = direction_of(self.editor, self.region, self.step)
                self.scene.objects[REFERENCE].draw_arrow("direction", *(ends or (None, None)))

    def _draw_plans(self, object_view: ObjectView) -> None:
        """Draw the colours and lines of one object."""
        self.draw_colours(object_view)
        by_similarity = self._shows_similarity(object_view)
        lines = {} if by_similarity else lines_of(self.editor, self.results, object_view.key)
        object_view.draw_lines(lines)

    def draw_colours(self, object_view: ObjectView) -> None:
        """Draw the colours of one object."""
        key = object_view.key
        by_confidence = self.colouring == "confidence"
        by_similarity = self._shows_similarity(object_view)
        plain = not (by_confidence or by_similarity)
        meshes = region_meshes_of(self.editor, self.results, key) if plain else {}
        result = self.results.by_target.get(key)
        made = self.results.surface(key)
        object_view.draw_surface(made if result is None else result.transfer_result.surface)
        if self.colouring == RESULT and (left := self.results.left_on(key)):
            return draw_result(object_view, left)
        object_view.draw_regions(meshes)
        if by_similarity:
            colours = similarity_colours(self._distances[key], self.similarity_width)
        else:
            colours = colours_of(self.editor, self.results, key, by_confidence, meshes)
        object_view.set_colours(colours)

    def recolour(self, colouring: str, width: float) -> None:
        """Colour by something else, or by another width of similarity.

        Raises NrdfError for similarity where no point has been picked.
        """
        with self.lock:
            if colouring == "similarity" and not self._distances:
                raise NrdfError("take 'Similarity' and click a point of the reference first")
            self.colouring, self.similarity_width = colouring, width
            self.draw()

    def descriptor_distances(self, key: str) -> np.ndarray | None:
        """The descriptor distances of an object's shown points (k,) to the picked point, if any."""
        return self._distances.get(key)

    def regions_changed(self) -> None:
        """Drop the lines that no longer hold, and plan new ones."""
        if self.colouring == "similarity":
            self.colouring = COLOURINGS[0]
        self.draw()
        self.plan()
        current = self.results.is_current
        targets = self.editor.document.targets
        if any(t.corrected and not current(t.object.name) for t in targets):
            self.transfer(_PLAN_AFTER_S)

    def _shows_similarity(self, object_view: ObjectView) -> bool:
        return self.colouring == "similarity" and object_view.key in self._distances

    def _forget_similarity(self) -> None:
        self._distances.clear()
        self._features = None

    # --- work in the background

    def plan(self, delay_s: float = _PLAN_AFTER_S) -> None:
        """Plan on the reference what is not planned yet."""
        self._plan_in_background(delay_s)
        self.make_surfaces()
        self.refresh_panel()

    def _plan_in_background(self, delay_s: float) -> None:
        document = self.editor.document
        self.submit("plan", "planning on the reference", delay_s,
                     lambda progress: self.results.make_plans(document, progress))  # fmt: skip

    def look(self, region: str, step: int) -> None:
        """Have a first look at a step that has just been changed, and plan it once that ends.

        A look that has begun is shown, and the newest one follows it.
        """
        document = self.editor.document

        def work(progress: Progress) -> None:
            self.results.look(document, region, step, progress)
            with self.lock, self.server.atomic():
                if REFERENCE in self.scene.objects:
                    self._draw_plans(self.scene.objects[REFERENCE])
                self.refresh_panel()

        self.worker.submit("look", "a first look", work, replaces=False)
        self._plan_in_background(_PLAN_AFTER_LOOK_S)

    def make_surfaces(self) -> None:
        """Make the surfaces of scans, to be drawn in place of their points."""
        document = self.editor.document
        if not self.results.without_surface(document):
            return
        self.submit("surfaces", "making surfaces of scans", 0.0,
                     lambda progress: self.results.make_surfaces(document, progress))  # fmt: skip

    def transfer(self, delay_s: float = 0.0) -> None:
        """Transfer the processes to the targets."""
        document = self.editor.document
        self.submit("transfer", "finding regions and planning tool paths", delay_s,
                     lambda progress: self.results.transfer(document, progress))  # fmt: skip

    def compare(self, key: str, index: int) -> None:
        """Colour every object by the similarity of its points to a shown point of the reference.

        The first time in the background; at once for every point that is picked after it.
        """
        if key != REFERENCE:
            raise NrdfError("pick a point of the reference: similar points are coloured everywhere")
        self._picked_point = index
        if self._features is not None and self.colouring == "similarity":
            self._distances = self._features.distances(index)
            for object_view in self.scene.objects.values():
                self.draw_colours(object_view)
            return
        document = self.editor.document

        def work(progress: Progress) -> None:
            features = self.results.correspondence_features(document, progress)
            with self.lock:
                self._features = features
                self._distances = features.distances(self._picked_point)
                self.colouring = "similarity"

        if self._features is not None or not self.worker.has_job("similarity"):
            self._features = None
            self.submit("similarity", "comparing descriptors", 0.0, work)

    def submit(
        self, kind: str, what: str, delay_s: float, work: Callable[[Progress], None]
    ) -> None:
        """Work in the background, after a delay, then show what it has made, however it ended."""

        def work_and_show(progress: Progress) -> None:
            try:
                work(progress)
            finally:
                with self.lock:
                    if kind != "similarity":
                        self._features = None  # they are of the objects before
                    self.draw()
                    self.refresh_panel()

        self.worker.submit(kind, what, work_and_show, delay_s)

    # --- messages

    def need_region(self) -> None:
        """Raises NrdfError where no region is selected."""
        if self.editor.document.region(self.region) is None:
            raise NrdfError("there is no region yet: press 'New region' in step 2 first")

    @contextmanager
    def reporting_errors(self) -> Iterator[None]:
        """Hold the lock during a block, and show on the page what goes wrong in it."""
        with self.lock:
            self.show_error("")
            try:
                yield
            except NrdfError as error:
                self.refresh_panel()
                self.notify("That did not work", str(error))
            except Exception as error:
                log.exception("internal error of the studio")
                self.notify("Internal error of nrdf", f"{type(error).__name__}: {error}")

    def notify(self, title: str, text: str, bad: bool = True) -> None:
        """Notify every open page; what is bad also stays in the panel until the next input."""
        text = text.removeprefix(f"{ORIGIN}: ")
        if bad:
            self.show_error(f"⚠ **{title}**: {text}")
        for client in self.server.get_clients().values():
            client.add_notification(
                title, text, color="red" if bad else "teal", auto_close_seconds=15 if bad else 6
            )

    def notify_end(self, what: str, error: str) -> None:
        """Notify of work in the background that was cancelled or has failed."""
        if error == "cancelled":
            self.notify(what, "cancelled; what was finished is kept", bad=False)
        elif error:
            self.notify(what, error)
