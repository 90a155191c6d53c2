"""What takes long, or reads what strangers have made: plans, transfers, descriptors and uploads.

It can be done in a process of its own, so that whatever ends that process (a fault of native code,
a lack of memory) leaves the studio, and all that a person has made, alive.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from nrdf.errors import NrdfError, ProcessError
from nrdf.field.encoded_cloud import NORMAL_WEIGHT, oriented_features
from nrdf.io.cloud import PointCloud
from nrdf.process.check import CheckedProcess, check_process
from nrdf.process.taught_paths import contact_points
from nrdf.process.transfer import ProcessTransfer
from nrdf.process.transfer_result import TransferResult
from nrdf.studio.model.child_process import ChildProcess, answer, progress_of
from nrdf.studio.model.document import Document, LoadedObject, PaintedRegion
from nrdf.studio.model.paintable_cloud import PaintableCloud
from nrdf.studio.model.teaching import bound_knowledge_of, process_of
from nrdf.studio.model.uploads import read_upload
from nrdf.studio.model.worker import Progress

if TYPE_CHECKING:
    from nrdf.field.encoded_cloud import EncodedCloud
    from nrdf.regions.model import Model

_NOT_SENT = PointCloud(np.zeros((0, 3)))


class ComputingProcessEnded(NrdfError):
    """The process that computes has ended by itself."""


@dataclass(frozen=True)
class Plan:
    """A step on the reference. fault: why there is no plan; checked: None where the step itself is
    wrong."""

    fault: str
    checked: CheckedProcess | None = None

    @property
    def lines(self) -> list[np.ndarray]:
        """Places (m, 3) on the surface that each line works."""
        if self.checked is None:
            return []
        height = self.checked.process.standoff_m
        return [
            contact_points(s.positions, s.quaternions_xyzw, height)
            for s in self.checked.segments
            if s.kind == "process"
        ]


@dataclass(frozen=True)
class CorrespondenceFeatures:
    """What the descriptors of several objects say, by
    `nrdf.regions.reference.EncodedReference.described`.

    objects: (n, 6) of the points that are shown, by object. reference: (k, 6) of the reference's
    own points; nearest: (m,) which of them stands for each of its cloud's points.
    """

    objects: Mapping[str, np.ndarray]
    reference: np.ndarray
    nearest: np.ndarray

    def distances(self, index: int) -> dict[str, np.ndarray]:
        """How far each object's shown points (k,) are from a shown point of the reference."""
        here = self.reference[self.nearest[index]]
        return {key: np.linalg.norm(said - here, axis=1) for key, said in self.objects.items()}


class LocalComputing:
    """Computes for one document after the other, and keeps what the next can use.

    load: gives the model of a category. Every order is a method, by name and arguments; `share`
    comes before those that are about objects.
    """

    def __init__(self, load: Callable[[str], Model]) -> None:
        self._load = load
        self._models: dict[str, Model] = {}
        self._clouds: dict[str, PointCloud] = {}
        self._paintables: dict[str, PaintableCloud] = {}
        self._embedded: dict[tuple[str, str], EncodedCloud] = {}
        self._said: dict[tuple[str, str, str], np.ndarray] = {}
        self._teacher: tuple[int, ProcessTransfer] | None = None

    def ask(self, name: str, *args: Any, progress: Progress) -> Any:
        """One of the methods below, by its name."""
        return getattr(self, name)(*args, progress=progress)

    def share(self, objects: Iterable[LoadedObject]) -> None:
        """Know the clouds of these objects, by their files, and forget all others."""
        self.know({loaded.file: loaded.cloud for loaded in objects})

    def know(self, clouds: Mapping[str, PointCloud | None]) -> None:
        """Know these clouds, by their files; None stands for one that is known already."""
        self._clouds = {f: self._clouds[f] if c is None else c for f, c in clouds.items()}
        self._paintables = {
            f: paintable for f, paintable in self._paintables.items() if f in clouds
        }
        self._embedded = {k: kept for k, kept in self._embedded.items() if k[1] in clouds}
        self._said = {k: said for k, said in self._said.items() if {k[1], k[2]} <= set(clouds)}

    def end(self) -> None:
        """Nothing is to be ended."""

    def read(
        self, name: str, content: bytes, category: str, unit: str | None, progress: Progress
    ) -> PointCloud:
        """`nrdf.studio.model.uploads.read_upload`."""
        progress(0, 1)
        return read_upload(name, content, category, unit)

    def plan(self, reference: str, region: PaintedRegion, number: int, progress: Progress) -> Plan:
        """A step of a region, planned on the reference."""
        progress(0, 1)
        try:
            process = process_of(region, number)
        except ProcessError as error:
            return Plan(str(error))
        paintable = self._paintable(reference)
        indices = np.flatnonzero(region.mask)
        checked = check_process(paintable.surface, region.name, indices, process, paintable.given)
        return Plan(f"{checked.where}: {checked.fault}" if checked.fault else "", checked)

    def teach(self, lesson: int, clouds: Path, document: Document, progress: Progress) -> None:
        """Get ready to bring a document's processes to targets. lesson: its number, which differs
        for what teaches something else; clouds: the folder of their files.

        Raises NrdfError for a document that is not complete, naming region, field and value.
        """
        progress(0, 1)
        if self._teacher is None or self._teacher[0] != lesson:
            model = self._model(document.category)
            self._teacher = lesson, ProcessTransfer(bound_knowledge_of(clouds, document), model)

    def transfer(
        self, target: str, marked: Mapping[str, np.ndarray], progress: Progress
    ) -> TransferResult:
        """Bring what was taught last to the object of a file; marked: regions painted on it."""
        progress(0, 1)
        teacher = self._taught
        return teacher.transfer(self._seen(target), marked=dict(marked), progress=progress)

    def describe(
        self, reference: str, files: Mapping[str, str], progress: Progress
    ) -> CorrespondenceFeatures:
        """What the descriptors of objects, by key and file, say of what was taught last."""
        taught = self._taught.reference
        said = {}
        for done, (key, file) in enumerate(files.items()):
            progress(done, len(files))
            place = (self._taught.model.category, reference, file)
            if place not in self._said:
                seen = taught.reference if file == reference else self._seen(file)
                self._said[place] = taught.correspondence_features(seen)
            said[key] = self._said[place]
        own = oriented_features(taught.reference.points, taught.reference.normals, NORMAL_WEIGHT)
        return CorrespondenceFeatures(said, own, taught.reference.nearest_working)

    @property
    def _taught(self) -> ProcessTransfer:
        assert self._teacher is not None, "`teach` comes first"
        return self._teacher[1]

    def _model(self, category: str) -> Model:
        if category not in self._models:
            self._models[category] = self._load(category)
        return self._models[category]

    def _paintable(self, file: str) -> PaintableCloud:
        if file not in self._paintables:
            self._paintables[file] = PaintableCloud(self._clouds[file])
        return self._paintables[file]

    def _seen(self, file: str) -> EncodedCloud:
        model = self._taught.model
        if (model.category, file) not in self._embedded:
            self._embedded[model.category, file] = model.encode(self._clouds[file])
        return self._embedded[model.category, file]


class ChildProcessComputing:
    """The same, in a process of its own, which is started when it is needed, and again when it has
    ended; clouds go there once.

    load: can be sent to a process: a function of a module, or `functools.partial` of one.
    """

    def __init__(self, load: Callable[[str], Model]) -> None:
        self._load = load
        self._child: ChildProcess | None = None
        self._wanted: dict[str, PointCloud] = {}
        self._known: set[str] = set()

    def share(self, objects: Iterable[LoadedObject]) -> None:
        """As of `LocalComputing`."""
        self._wanted = {loaded.file: loaded.cloud for loaded in objects}

    def ask(self, name: str, *args: Any, progress: Progress) -> Any:
        """As of `LocalComputing`. Raises ComputingProcessEnded if the process ends before it
        answers."""
        if self._child is None or not self._child.alive:
            self.end()
            self._child = ChildProcess(_serve, (self._load,), _gone)
        sent = {f: None if f in self._known else c for f, c in self._wanted.items()}
        self._known = set(sent)
        try:
            return self._child.ask((sent, name, args), progress)
        except ComputingProcessEnded:
            self.end()
            raise

    def end(self) -> None:
        """End the process."""
        self._known = set()
        if self._child is not None:
            self._child.end()
        self._child = None


def without_clouds(document: Document) -> Document:
    """The document as it is sent: objects are known by their files."""

    def bare(loaded: LoadedObject) -> LoadedObject:
        return replace(loaded, cloud=_NOT_SENT)

    reference = None if document.reference is None else bare(document.reference)
    targets = tuple(replace(t, object=bare(t.object)) for t in document.targets)
    return replace(document, reference=reference, targets=targets)


def _gone(why: str) -> ComputingProcessEnded:
    return ComputingProcessEnded(
        f"the process that computes has ended by itself ({why}), by a fault of native code or for "
        "lack of memory. What you made is kept. It is started again with the next thing that you "
        "do; if it ends again, take away the object or region that it worked on"
    )


def _serve(pipe: Connection, load: Callable[[str], Model]) -> None:
    """In the process: what is asked for, until the other side is gone."""
    computing = LocalComputing(load)
    while True:
        order = pipe.recv()
        if order is not None:  # else given up when it was answered already
            clouds, name, args = order
            computing.know(clouds)
            ask = partial(computing.ask, name, *args, progress=progress_of(pipe))
            answer(pipe, ask)
