"""What is computed of a session: plans on the reference, and transfer results on the targets."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from nrdf.errors import NrdfError, ProcessError
from nrdf.geometry.mesh import Mesh
from nrdf.io.cloud import PointCloud
from nrdf.process.bound_knowledge import BoundKnowledge
from nrdf.process.limits import LOW_CONFIDENCE
from nrdf.process.model_choice import choose_model
from nrdf.process.transfer_result import TransferResult
from nrdf.studio.model.cell_upload import CELL
from nrdf.studio.model.computed import CorrespondenceFeatures, LeftResult, Plan
from nrdf.studio.model.computing import (
    ChildProcessComputing,
    LocalComputing,
    without_clouds,
)
from nrdf.studio.model.document import REFERENCE, Document, LoadedObject, PaintedRegion, Target
from nrdf.studio.model.editor import Editor
from nrdf.studio.model.placing import PlacedScan
from nrdf.studio.model.studio_cell import StudioCell
from nrdf.studio.model.worker import Progress


@dataclass(frozen=True)
class TargetResult:
    """A target's transfer result. revision: the number of the processes that were transferred."""

    transfer_result: TransferResult
    revision: int
    target: Target

    @property
    def uncertain_regions(self) -> list[str]:
        """Regions that a person should check: not found, or found with low confidence."""
        regions = self.transfer_result.regions.values()
        return [r.name for r in regions if r.missing or r.match.score < LOW_CONFIDENCE]

    @cached_property
    def left(self) -> list[LeftResult]:
        """What the last process of each region with a wanted result leaves."""
        paths = self.transfer_result.paths
        made = {p.region: LeftResult.of(p.region, p.process, p.result) for p in paths if p.result}
        return [left for left in made.values() if left is not None]


class ResultCache:
    """Plans and transfer results of a document, each kept as long as it is current."""

    def __init__(self, editor: Editor, computing: LocalComputing | ChildProcessComputing) -> None:
        self.editor = editor
        self.by_target: dict[str, TargetResult] = {}
        self._computing = computing
        self._plans: dict[tuple[str, int], tuple[bytes, Plan]] = {}
        self._looked: tuple[np.ndarray, tuple[str, int], Plan] | None = None
        self._region_meshes: dict[str, tuple[np.ndarray, Mesh]] = {}
        self._surfaces: dict[str, Mesh | None] = {}
        self._revision: tuple[Document, int] | None = None
        self._revisions = 0

    def stop(self) -> None:
        """End what computes."""
        self._computing.end()

    def read(
        self, name: str, content: bytes, category: str, unit: str | None, progress: Progress
    ) -> PointCloud:
        """The cloud, in metres, of a file that a browser sent, as of `read_upload`."""
        cloud: PointCloud = self._computing.call(
            "read", name, content, category, unit, progress=progress
        )
        return cloud

    def read_knowledge(self, name: str, content: bytes, progress: Progress) -> BoundKnowledge:
        """The knowledge of a ZIP archive that a browser sent, as of `read_knowledge_zip`."""
        bound: BoundKnowledge = self._computing.call(
            "read_knowledge", name, content, progress=progress
        )
        return bound

    def store_cell(self, name: str, content: bytes, progress: Progress) -> StudioCell:
        """Keep a cell file that a browser sent with the session, as of `store_cell`."""
        place = self.editor.session.folder / CELL
        file: Path = self._computing.call("store_cell", name, content, place, progress=progress)
        return StudioCell.of(file)

    def read_scan(
        self, name: str, content: bytes, document: Document, unit: str | None, progress: Progress
    ) -> PlacedScan:
        """A file that a browser sent, as of `place_scan`, for a document's reference."""
        reference, model = _aligned_by(document)
        placed: PlacedScan = self._computing.call(
            "read_scan", name, content, model, reference, unit, progress=progress
        )
        return placed

    def clean_again(
        self, scan: PointCloud, document: Document, skipped: Sequence[str], number: int,
        progress: Progress,
    ) -> PlacedScan:  # fmt: skip
        """A scan, in metres, as of `place_scan`, for a document's reference."""
        reference, model = _aligned_by(document)
        placed: PlacedScan = self._computing.call(
            "clean_again", scan, model, reference, skipped, number, progress=progress
        )
        return placed

    # --- surfaces

    def surface(self, key: str) -> Mesh | None:
        """The surface of a scan that is drawn, where one was made."""
        target, reference = self.editor.target(key), self.editor.document.reference
        loaded = reference if target is None else target.object
        return None if loaded is None else self._surfaces.get(loaded.file)

    def without_surface(self, document: Document) -> list[LoadedObject]:
        """Scans whose surface has not been asked for."""
        scans = [loaded for loaded in _objects(document) if loaded.cloud.mesh is None]
        return [loaded for loaded in scans if loaded.file not in self._surfaces]

    def make_surfaces(self, document: Document, progress: Progress) -> None:
        """Make the surface of every scan that has none yet."""
        objects = _objects(document)
        files = {loaded.file for loaded in objects}
        self._surfaces = {file: m for file, m in self._surfaces.items() if file in files}
        waiting = self.without_surface(document)
        for done, loaded in enumerate(waiting):
            self._computing.use_objects(objects)
            self._surfaces[loaded.file] = self._computing.call(
                "surface", loaded.file, progress=_within(progress, done, len(waiting))
            )

    def left_on(self, key: str) -> list[LeftResult]:
        """What is left on an object, of each region's last process with a wanted result."""
        if key == REFERENCE:
            return self.left_on_reference()
        found = self.by_target.get(key)
        return [] if found is None else found.left

    # --- plans on the reference

    def plan(self, region: PaintedRegion, number: int) -> Plan | None:
        """A process step's plan, None where the current region and step are not planned yet."""
        kept = self._plans.get((region.name, number))
        plan_key = _plan_key(self.editor.document, region, number)
        return kept[1] if kept is not None and kept[0] == plan_key else None

    def shown_plan(self, region: PaintedRegion, number: int) -> Plan | None:
        """The plan, or the last first look at a step of the region as it is painted now."""
        made = self.plan(region, number)
        if made is None and self._looked is not None:
            mask, key, looked = self._looked
            made = looked if key == (region.name, number) and mask is region.mask else None
        return made

    def shown_mesh(self, region: PaintedRegion) -> Mesh | None:
        """The mesh of a region as it is painted now, where one of its steps was planned."""
        mask, mesh = self._region_meshes.get(region.name, (None, None))
        return mesh if mask is region.mask else None

    def planned_lines(self, region: PaintedRegion) -> list[np.ndarray]:
        """The lines, each (m, 3), of a region's steps that are planned."""
        plans = [self.shown_plan(region, number) for number in range(len(region.steps))]
        return [line for plan in plans if plan is not None for line in plan.lines]

    def left_on_reference(self) -> list[LeftResult]:
        """What the last step of each region with a wanted result leaves on the reference."""
        found = []
        for region in self.editor.document.regions:
            plans = [self.shown_plan(region, number) for number in range(len(region.steps))]
            left = [plan.left for plan in plans if plan is not None and plan.left is not None]
            found += left[-1:]
        return found

    def look(self, document: Document, name: str, number: int, progress: Progress) -> None:
        """Have a first look at a step of a region, until it is planned."""
        region = document.region(name)
        if region is None or document.reference is None or not region.mask.any():
            return
        made = self._plan(document, region, number, True, progress)
        self._looked = region.mask, (name, number), made

    def make_plans(self, document: Document, progress: Progress) -> None:
        """Plan every step that is not planned yet, of regions that have points."""
        waiting = [
            (region, number)
            for region in document.regions if region.mask.any()
            for number in range(len(region.steps)) if self.plan(region, number) is None
        ]  # fmt: skip
        for done, (region, number) in enumerate(waiting):
            progress(done, len(waiting))
            if self.editor.document.reference is not document.reference:
                return
            within = _within(progress, done, len(waiting))
            made = self._plan(document, region, number, False, within)
            self._plans[region.name, number] = _plan_key(document, region, number), made
            if made.region is not None:
                self._region_meshes[region.name] = region.mask, made.region

    def _plan(
        self, document: Document, region: PaintedRegion, number: int, rough: bool,
        progress: Progress,
    ) -> Plan:  # fmt: skip
        self._computing.use_objects(_objects(document))
        assert document.reference is not None  # regions are on one
        made: Plan = self._computing.call(
            "plan", document.reference.file, region, number, rough, progress=progress
        )
        return made

    # --- targets

    def is_current(self, key: str) -> bool:
        """Whether a target's result is of the current regions and processes."""
        result = self.by_target.get(key)
        return (
            result is not None
            and result.target is self.editor.target(key)
            and self._revision is not None
            and result.revision == self._revision[1]
            and _same_processes(self._revision[0], self.editor.document)
        )

    def ready(self, key: str) -> TargetResult:
        """A target's current result. Raises ProcessError where there is none."""
        result = self.by_target.get(key)
        if result is None:
            raise ProcessError("nothing is transferred to a target yet: do so in step 4")
        if not self.is_current(key):
            raise ProcessError(
                f"the result on {key} is of before your last change: press 'Transfer the process' "
                "in step 4 first"
            )
        return result

    def transfer(self, document: Document, progress: Progress) -> None:
        """Transfer the processes to every target whose result is not current.

        Raises NrdfError for a document that is not complete, naming region, field and value, and
        what `ProcessTransfer.transfer` raises, naming the target.
        """
        revision = self._prepare(document, progress)
        targets = [t for t in document.targets if not self._is_of(t, revision)]
        for done, target in enumerate(targets):
            self._transfer(target, revision, _within(progress, done, len(targets)))

    def _is_of(self, target: Target, revision: int) -> bool:
        result = self.by_target.get(target.object.name)
        return result is not None and result.revision == revision and result.target is target

    def _prepare(self, document: Document, progress: Progress) -> int:
        """Prepare to transfer a document's processes; their revision."""
        if self._revision is not None and _same_processes(self._revision[0], document):
            number = self._revision[1]
        else:  # a new number: a cancelled preparation may have been completed all the same
            self._revisions += 1
            number = self._revisions
        self._computing.use_objects(_objects(document))
        clouds = self.editor.session.clouds
        self._computing.call("prepare", number, clouds, without_clouds(document), progress=progress)
        self._revision = document, number
        return number

    def _transfer(self, target: Target, revision: int, progress: Progress) -> None:
        name = target.object.name
        try:
            transfer_result = self._computing.call(
                "transfer", target.object.file, dict(target.corrected), progress=progress
            )
        except NrdfError as error:
            raise type(error)(f"target {name}: {error}") from None
        self.by_target[name] = TargetResult(transfer_result, revision, target)

    # --- similarity

    def correspondence_features(
        self, document: Document, progress: Progress
    ) -> CorrespondenceFeatures:
        """Features of the reference and of every target with a result; unchanged ones are kept."""
        self._prepare(document, progress)
        assert document.reference is not None  # else nothing is prepared
        files = {REFERENCE: document.reference.file}
        files |= {key: r.target.object.file for key, r in self.by_target.items()}
        results = [result.target.object for result in self.by_target.values()]
        self._computing.use_objects([*_objects(document), *results])
        features: CorrespondenceFeatures = self._computing.call(
            "correspondence_features", document.reference.file, files, progress=progress
        )
        return features


def _aligned_by(document: Document) -> tuple[PointCloud, str]:
    """What scans are aligned by: the reference, and the name of the model."""
    if document.reference is None:
        raise ProcessError("there is no reference yet: load one in step 1")
    model = choose_model(document.category, document.model, allow_unusual=True).name
    return document.reference.cloud, model


def _objects(document: Document) -> list[LoadedObject]:
    first = [] if document.reference is None else [document.reference]
    return [*first, *(target.object for target in document.targets)]


def _plan_key(document: Document, region: PaintedRegion, number: int) -> bytes:
    """Identifies everything that a plan depends on."""
    reference = "" if document.reference is None else document.reference.file
    text = json.dumps([reference, region.name, dict(region.steps[number])], sort_keys=True)
    return text.encode() + np.packbits(region.mask).tobytes()


def _same_processes(one: Document, other: Document) -> bool:
    """Whether two documents have the same regions and processes; colours do not count."""

    def content(document: Document) -> tuple[object, ...]:
        regions = tuple((r.name, id(r.mask), id(r.steps)) for r in document.regions)
        kind = (document.category, document.model)
        return (kind, document.allow_overlap, id(document.reference), regions)

    return content(one) == content(other)


def _within(progress: Progress, number: int, count: int) -> Progress:
    """Progress of one part of several, in per cent of a part."""
    return lambda done, total: progress(int(100 * (number + done / total)), 100 * count)
