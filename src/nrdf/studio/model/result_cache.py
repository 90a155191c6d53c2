"""What is computed of a session: plans on the reference, and what arrives on the targets."""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np

from nrdf.errors import NrdfError, ProcessError
from nrdf.io.cloud import PointCloud
from nrdf.process.limits import LOW_CONFIDENCE
from nrdf.process.transfer_result import TransferResult
from nrdf.studio.model.computing import (
    ChildProcessComputing,
    CorrespondenceFeatures,
    LocalComputing,
    Plan,
    without_clouds,
)
from nrdf.studio.model.document import REFERENCE, Document, LoadedObject, PaintedRegion, Target
from nrdf.studio.model.editor import Editor
from nrdf.studio.model.worker import Progress


@dataclass(frozen=True)
class TargetResult:
    """What arrived on a target, and of which lesson, by its number."""

    transfer_result: TransferResult
    lesson: int
    target: Target

    @property
    def uncertain_regions(self) -> list[str]:
        """Regions that a person should look at: skipped, or found with little confidence."""
        regions = self.transfer_result.regions.values()
        return [r.name for r in regions if r.missing or r.match.score < LOW_CONFIDENCE]


class ResultCache:
    """Plans and transfers of a editor's document, each kept as long as it holds."""

    def __init__(self, editor: Editor, computing: LocalComputing | ChildProcessComputing) -> None:
        self.editor = editor
        self.by_target: dict[str, TargetResult] = {}
        self._computing = computing
        self._plans: dict[tuple[str, int], tuple[bytes, Plan]] = {}
        self._lesson: tuple[Document, int] | None = None
        self._lessons = 0

    def stop(self) -> None:
        """End what computes."""
        self._computing.end()

    def read(
        self, name: str, content: bytes, category: str, unit: str | None, progress: Progress
    ) -> PointCloud:
        """The cloud, in metres, of a file that a browser sent, as of `read_upload`."""
        cloud: PointCloud = self._computing.ask(
            "read", name, content, category, unit, progress=progress
        )
        return cloud

    # --- plans on the reference

    def plan(self, region: PaintedRegion, number: int) -> Plan | None:
        """A step's plan, None where it has not been made yet for what is painted and filled in."""
        kept = self._plans.get((region.name, number))
        basis = _basis(self.editor.document, region, number)
        return kept[1] if kept is not None and kept[0] == basis else None

    def planned(self, region: PaintedRegion) -> list[np.ndarray]:
        """The lines (m, 3) of a region's steps that are planned."""
        plans = [self.plan(region, number) for number in range(len(region.steps))]
        return [line for plan in plans if plan is not None for line in plan.lines]

    def make_plans(self, document: Document, progress: Progress) -> None:
        """Plan every step that is not planned yet, those of regions with points."""
        waiting = [
            (region, number)
            for region in document.regions if region.mask.any()
            for number in range(len(region.steps)) if self.plan(region, number) is None
        ]  # fmt: skip
        for done, (region, number) in enumerate(waiting):
            progress(done, len(waiting))
            if self.editor.document.reference is not document.reference:
                return
            basis = _basis(document, region, number)
            self._computing.share(_objects(document))
            assert document.reference is not None  # regions are on one
            made = self._computing.ask(
                "plan", document.reference.file, region, number,
                progress=_within(progress, done, len(waiting)),
            )  # fmt: skip
            self._plans[region.name, number] = basis, made

    # --- targets

    def is_current(self, key: str) -> bool:
        """Whether a target's result is that of what is painted and filled in now."""
        result = self.by_target.get(key)
        return (
            result is not None
            and result.target is self.editor.target(key)
            and self._lesson is not None
            and result.lesson == self._lesson[1]
            and _same_lesson(self._lesson[0], self.editor.document)
        )

    def ready(self, key: str) -> TargetResult:
        """A target's result. Raises ProcessError where there is none of what is painted now."""
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
        """Bring the processes to every target whose result is not current.

        Raises NrdfError for a document that is not complete, naming region, field and value, and
        what `ProcessTransfer.transfer` raises, naming the target.
        """
        lesson = self._taught(document, progress)
        targets = [t for t in document.targets if not self._has(t, lesson)]
        for done, target in enumerate(targets):
            self._transfer(target, lesson, _within(progress, done, len(targets)))

    def _has(self, target: Target, lesson: int) -> bool:
        result = self.by_target.get(target.object.name)
        return result is not None and result.lesson == lesson and result.target is target

    def _taught(self, document: Document, progress: Progress) -> int:
        """The number of what a document teaches, which is ready to be transferred then."""
        if self._lesson is not None and _same_lesson(self._lesson[0], document):
            number = self._lesson[1]
        else:  # one that was never given: what was cancelled may have been taught all the same
            self._lessons += 1
            number = self._lessons
        self._computing.share(_objects(document))
        clouds = self.editor.session.clouds
        self._computing.ask("teach", number, clouds, without_clouds(document), progress=progress)
        self._lesson = document, number
        return number

    def _transfer(self, target: Target, lesson: int, progress: Progress) -> None:
        name = target.object.name
        try:
            transfer_result = self._computing.ask(
                "transfer", target.object.file, dict(target.corrected), progress=progress
            )
        except NrdfError as error:
            raise type(error)(f"target {name}: {error}") from None
        self.by_target[name] = TargetResult(transfer_result, lesson, target)

    # --- similarity

    def correspondence_features(
        self, document: Document, progress: Progress
    ) -> CorrespondenceFeatures:
        """What the descriptors of the reference and of every target with a result say, computed
        where it has changed."""
        self._taught(document, progress)
        assert document.reference is not None  # else nothing is taught
        files = {REFERENCE: document.reference.file}
        files |= {key: r.target.object.file for key, r in self.by_target.items()}
        results = [result.target.object for result in self.by_target.values()]
        self._computing.share([*_objects(document), *results])
        described: CorrespondenceFeatures = self._computing.ask(
            "describe", document.reference.file, files, progress=progress
        )
        return described


def _objects(document: Document) -> list[LoadedObject]:
    first = [] if document.reference is None else [document.reference]
    return [*first, *(target.object for target in document.targets)]


def _basis(document: Document, region: PaintedRegion, number: int) -> bytes:
    """What a plan depends on."""
    reference = "" if document.reference is None else document.reference.file
    said = json.dumps([reference, region.name, dict(region.steps[number])], sort_keys=True)
    return said.encode() + np.packbits(region.mask).tobytes()


def _same_lesson(one: Document, other: Document) -> bool:
    """Whether two documents teach the same; colours do not count."""

    def taught(document: Document) -> tuple[object, ...]:
        regions = tuple((r.name, id(r.mask), id(r.steps)) for r in document.regions)
        return (document.category, document.allow_overlap, id(document.reference), regions)

    return taught(one) == taught(other)


def _within(progress: Progress, number: int, count: int) -> Progress:
    """Progress of one part of several, in hundredths of all."""
    return lambda done, total: progress(int(100 * (number + done / total)), 100 * count)
