"""What takes long or reads untrusted files: plans, transfers, descriptors and uploads.

It can run in a child process. Whatever ends that process (a crash of native code, a lack of memory)
leaves the studio and the session alive.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from nrdf.errors import NrdfError, ProcessError
from nrdf.field.encoded_cloud import NORMAL_WEIGHT
from nrdf.geometry.mesh import Mesh
from nrdf.geometry.normals import oriented_features
from nrdf.geometry.simplify import simplified
from nrdf.io.cloud import PointCloud
from nrdf.process.bound_knowledge import BoundKnowledge
from nrdf.process.check import check_process
from nrdf.process.model_choice import choose_model
from nrdf.process.transfer import ProcessTransfer
from nrdf.process.transfer_result import TransferResult
from nrdf.studio.model.cell_upload import store_cell
from nrdf.studio.model.child_process import ChildProcess, answer, progress_of
from nrdf.studio.model.computed import CorrespondenceFeatures, LeftResult, Plan
from nrdf.studio.model.document import Document, LoadedObject, PaintedRegion
from nrdf.studio.model.paintable_cloud import SHOWN_FACES, PaintableCloud
from nrdf.studio.model.placing import PlacedScan, Placement, place_scan
from nrdf.studio.model.teaching import bound_knowledge_of, process_of
from nrdf.studio.model.uploads import (
    read_knowledge_zip,
    read_sent,
    read_upload,
    shown_name,
)
from nrdf.studio.model.worker import Progress

if TYPE_CHECKING:
    from nrdf.field.encoded_cloud import EncodedCloud
    from nrdf.regions.model import Model

_NOT_SENT = PointCloud(np.zeros((0, 3)))


class ComputingProcessEnded(NrdfError):
    """The child process that computes has ended by itself."""


class LocalComputing:
    """Computes in this process, for one document after the other, and keeps what the next can use.

    load: gives a model by its name. `use_objects` comes before the methods that are about
    objects, which are named by their files.
    """

    def __init__(self, load: Callable[[str], Model]) -> None:
        self._load = load
        self._models: dict[str, Model] = {}
        self._clouds: dict[str, PointCloud] = {}
        self._poses: Mapping[str, Placement] = {}
        self._paintables: dict[str, PaintableCloud] = {}
        self._encoded: dict[tuple[str, str], EncodedCloud] = {}
        self._features: dict[tuple[str, str, str], np.ndarray] = {}
        self._transfer_process: tuple[int, ProcessTransfer] | None = None

    def call(self, name: str, *args: Any, progress: Progress) -> Any:
        """Call one of the methods below by its name."""
        return getattr(self, name)(*args, progress=progress)

    def use_objects(self, objects: Iterable[LoadedObject]) -> None:
        """Take the clouds of these objects, and forget all others."""
        kept = list(objects)
        self.use_clouds({loaded.file: loaded.cloud for loaded in kept}, _placements(kept))

    def use_clouds(
        self, clouds: Mapping[str, PointCloud | None], placements: Mapping[str, Placement]
    ) -> None:
        """Take these clouds, by file, and how they stand; None stands for a cloud that was taken
        before."""
        turned = {f for f in self._encoded_files if not _same_pose(f, self._poses, placements)}
        self._poses = dict(placements)
        self._encoded = {k: kept for k, kept in self._encoded.items() if k[1] not in turned}
        self._features = {k: kept for k, kept in self._features.items() if k[2] not in turned}
        self._clouds = {f: self._clouds[f] if c is None else c for f, c in clouds.items()}
        self._paintables = {
            f: paintable for f, paintable in self._paintables.items() if f in clouds
        }
        self._encoded = {k: kept for k, kept in self._encoded.items() if k[1] in clouds}
        self._features = {
            k: kept for k, kept in self._features.items() if {k[1], k[2]} <= set(clouds)
        }

    def end(self) -> None:
        """Does nothing: there is no process to end."""

    def read(
        self, name: str, content: bytes, category: str, unit: str | None, progress: Progress
    ) -> PointCloud:
        """`nrdf.studio.model.uploads.read_upload`."""
        progress(0, 1)
        return read_upload(name, content, category, unit)

    def read_knowledge(self, name: str, content: bytes, progress: Progress) -> BoundKnowledge:
        """`nrdf.studio.model.uploads.read_knowledge_zip`."""
        progress(0, 1)
        return read_knowledge_zip(name, content)

    def store_cell(self, name: str, content: bytes, place: Path, progress: Progress) -> Path:
        """`nrdf.studio.model.cell_upload.store_cell`."""
        progress(0, 1)
        return store_cell(name, content, place)

    def read_scan(
        self, name: str, content: bytes, model: str, reference: PointCloud, unit: str | None,
        progress: Progress,
    ) -> PlacedScan:  # fmt: skip
        """Read, clean and align a file that a browser sent; model: of the reference's category."""
        progress(0, 3)
        scan = read_sent(name, content)
        progress(1, 3)
        return place_scan(scan, self._model(model), reference, shown_name(name), unit)

    def clean_again(
        self, scan: PointCloud, model: str, reference: PointCloud, skipped: Sequence[str],
        number: int, progress: Progress,
    ) -> PlacedScan:  # fmt: skip
        """Clean and align a scan, in metres, again; skipped, number: as of `place_scan`."""
        progress(0, 1)
        return place_scan(scan, self._model(model), reference, "the scan", None, skipped, number)

    def plan(
        self, reference: str, region: PaintedRegion, number: int, rough: bool, progress: Progress
    ) -> Plan:
        """Plan a process step of a region on the reference; rough: for a first look, without the
        region's mesh."""
        progress(0, 1)
        try:
            process = process_of(region, number)
        except ProcessError as error:
            return Plan(str(error))
        paintable = self._paintable(reference)
        try:
            mesh = paintable.region(region.mask, process.tool.radius_m)
        except ProcessError as error:
            return Plan(f"region '{region.name}': {error}")
        given = None if rough else paintable.given
        checked = check_process(mesh.for_a_look if rough else mesh, region.name, process, given)
        fault = f"{checked.where}: {checked.fault}" if checked.fault else ""
        left = LeftResult.of(region.name, process, checked.result)
        shown = None if rough else Mesh(mesh.mesh.vertices, mesh.mesh.faces)
        return Plan(fault, replace(checked, result=None), shown, left)

    def surface(self, file: str, progress: Progress) -> Mesh | None:
        """The surface of an object, as far as it is drawn; None where there can be none."""
        progress(0, 1)
        try:
            made = self._paintable(file).surface_for()
        except ProcessError:
            return None
        return Mesh(*simplified(made.vertices, made.faces, SHOWN_FACES))

    def prepare(self, revision: int, clouds: Path, document: Document, progress: Progress) -> None:
        """Prepare to transfer a document's processes to targets.

        revision: a number that differs for different processes; clouds: the folder of the clouds.

        Raises NrdfError for a document that is not complete, naming region, field and value.
        """
        progress(0, 1)
        if self._transfer_process is None or self._transfer_process[0] != revision:
            chosen = choose_model(document.category, document.model, allow_unusual=True)
            model = self._model(chosen.name)
            bound_knowledge = bound_knowledge_of(clouds, document)
            self._transfer_process = revision, ProcessTransfer(bound_knowledge, model)

    def transfer(
        self, target: str, marked: Mapping[str, np.ndarray], progress: Progress
    ) -> TransferResult:
        """Transfer the prepared processes to a target; marked: regions painted on it by hand."""
        progress(0, 1)
        target_cloud = self._encode(target)
        placement = self._poses.get(target)
        doubts, kind = None if placement is None else placement.warnings, None
        if placement is not None and placement.confirmed:
            doubts, kind = (), self._prepared.reference.check_kind(target_cloud).of_confirmed_pose
        return self._prepared.transfer(
            target_cloud, marked=dict(marked), progress=progress, target_warnings=doubts, kind=kind
        )

    def correspondence_features(
        self, reference: str, files: Mapping[str, str], progress: Progress
    ) -> CorrespondenceFeatures:
        """Correspondence features of objects, by key and file, with the prepared reference."""
        encoded = self._prepared.reference
        features = {}
        for done, (key, file) in enumerate(files.items()):
            progress(done, len(files))
            kept = (_name(self._prepared.model), reference, file)
            if kept not in self._features:
                cloud = encoded.encoded_cloud if file == reference else self._encode(file)
                self._features[kept] = encoded.correspondence_features(cloud)
            features[key] = self._features[kept]
        cloud = encoded.encoded_cloud
        own = oriented_features(cloud.points, cloud.normals, NORMAL_WEIGHT)
        return CorrespondenceFeatures(features, own, cloud.nearest_working)

    @property
    def _encoded_files(self) -> set[str]:
        return {file for _, file in self._encoded}

    @property
    def _prepared(self) -> ProcessTransfer:
        assert self._transfer_process is not None, "`prepare` comes first"
        return self._transfer_process[1]

    def _model(self, name: str) -> Model:
        if name not in self._models:
            self._models[name] = self._load(name)
        return self._models[name]

    def _paintable(self, file: str) -> PaintableCloud:
        if file not in self._paintables:
            self._paintables[file] = PaintableCloud(self._clouds[file])
        return self._paintables[file]

    def _encode(self, file: str) -> EncodedCloud:
        model = self._prepared.model
        if (_name(model), file) not in self._encoded:
            placement = self._poses.get(file)
            pose = (
                () if placement is None else (placement.pose.similarity, placement.pose.one_sided)
            )
            self._encoded[_name(model), file] = model.encode(self._clouds[file], *pose)
        return self._encoded[_name(model), file]


class ChildProcessComputing:
    """The same in a child process, which is started when it is needed, and again when it has ended.

    Each cloud is sent once. load: can be pickled: a function of a module, or `functools.partial`.
    """

    def __init__(self, load: Callable[[str], Model]) -> None:
        self._load = load
        self._child: ChildProcess | None = None
        self._wanted: dict[str, PointCloud] = {}
        self._placements: dict[str, Placement] = {}
        self._known: set[str] = set()

    def use_objects(self, objects: Iterable[LoadedObject]) -> None:
        """As of `LocalComputing`."""
        kept = list(objects)
        self._wanted = {loaded.file: loaded.cloud for loaded in kept}
        self._placements = _placements(kept)

    def call(self, name: str, *args: Any, progress: Progress) -> Any:
        """As of `LocalComputing`. Raises ComputingProcessEnded if the process ends before it
        answers."""
        if self._child is not None and not self._child.alive:
            self.end()
        self.start()
        assert self._child is not None  # it has been started
        sent = {f: None if f in self._known else c for f, c in self._wanted.items()}
        self._known = set(sent)
        try:
            return self._child.request((sent, self._placements, name, args), progress)
        except ComputingProcessEnded:
            self.end()
            raise

    def start(self) -> None:
        """Start the process before there is anything to compute: that takes seconds."""
        if self._child is None:
            self._child = ChildProcess(_serve, (self._load,), _ended_error)

    def end(self) -> None:
        """End the process."""
        self._known = set()
        if self._child is not None:
            self._child.end()
        self._child = None


def _name(model: Model) -> str:
    return str(model.metadata.get("name", model.category))


def _placements(objects: Iterable[LoadedObject]) -> dict[str, Placement]:
    return {loaded.file: loaded.placement for loaded in objects if loaded.placement is not None}


def _same_pose(file: str, one: Mapping[str, Placement], other: Mapping[str, Placement]) -> bool:
    """Whether an object stands in the same way by both."""
    ways = [
        None if file not in which else which[file].pose.similarity.T_scan_canonical.tobytes()
        for which in (one, other)
    ]
    return ways[0] == ways[1]


def without_clouds(document: Document) -> Document:
    """The document without its clouds, to be sent: objects are named by their files."""

    def without_cloud(loaded: LoadedObject) -> LoadedObject:
        return replace(loaded, cloud=_NOT_SENT, scan=None)

    reference = None if document.reference is None else without_cloud(document.reference)
    targets = tuple(replace(t, object=without_cloud(t.object)) for t in document.targets)
    return replace(document, reference=reference, targets=targets)


def _ended_error(why: str) -> ComputingProcessEnded:
    return ComputingProcessEnded(
        f"the process that computes has ended by itself ({why}), by a crash of native code or for "
        "lack of memory. Your session is kept. It is started again with the next thing that you "
        "do; if it ends again, remove the object or region that it worked on"
    )


def _serve(pipe: Connection, load: Callable[[str], Model]) -> None:
    """In the child process: answer calls until the studio has ended."""
    computing = LocalComputing(load)
    while True:
        request = pipe.recv()
        if request is not None:  # else cancelled after it was answered
            clouds, placements, name, args = request
            computing.use_clouds(clouds, placements)
            call = partial(computing.call, name, *args, progress=progress_of(pipe))
            answer(pipe, call)
