"""What is computed of a session: plans on the reference, and what arrives on the targets."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from nrdf.errors import NrdfError, ProcessError
from nrdf.process.knowledge_check import Checked, check_process
from nrdf.process.limits import DOUBTFUL
from nrdf.process.transfer import Teacher, Transferred, touched
from nrdf.regions.embedded import Embedded
from nrdf.studio.desk import Desk
from nrdf.studio.document import REFERENCE, Document, Painted, Target
from nrdf.studio.teaching import lesson_of, process_of
from nrdf.studio.worker import Progress

if TYPE_CHECKING:
    from nrdf.regions.model import Model
    from nrdf.regions.taught import Taught


@dataclass(frozen=True)
class Plan:
    """A step on the reference. fault: why there is no plan; checked: None where the step itself is
    wrong."""

    fault: str
    checked: Checked | None = None

    @property
    def lines(self) -> list[np.ndarray]:
        """Places (m, 3) on the surface that each line works."""
        if self.checked is None:
            return []
        height = self.checked.process.standoff_m
        return [
            touched(s.positions, s.quaternions_xyzw, height)
            for s in self.checked.segments
            if s.kind == "process"
        ]


@dataclass(frozen=True)
class Result:
    """What arrived on a target, and of which document."""

    transferred: Transferred
    embedded: Embedded
    teacher: Teacher
    target: Target

    @property
    def doubtful(self) -> list[str]:
        """Regions that a person should look at: skipped, or found with little confidence."""
        regions = self.transferred.regions.values()
        return [r.name for r in regions if r.missing or r.match.score < DOUBTFUL]


@dataclass(frozen=True)
class Described:
    """What the descriptors of several objects say, by `nrdf.regions.taught.Taught.described`."""

    objects: Mapping[str, tuple[Taught, np.ndarray]]

    def unlike(self, index: int) -> dict[str, np.ndarray]:
        """How far each object's shown points (k,) are from a shown point of the reference."""
        return {key: taught.unlike(index, said) for key, (taught, said) in self.objects.items()}


class Bench:
    """Plans and transfers of a desk's document, each kept as long as it holds.

    load: gives the model of a category.
    """

    def __init__(self, desk: Desk, load: Callable[[str], Model]) -> None:
        self.desk = desk
        self.results: dict[str, Result] = {}
        self._load = load
        self._models: dict[str, Model] = {}
        self._plans: dict[tuple[str, int], tuple[bytes, Plan]] = {}
        self._teacher: tuple[Document, Teacher] | None = None
        self._described: dict[str, tuple[Taught, Embedded, np.ndarray]] = {}

    def model(self, category: str) -> Model:
        """The category's model, loaded once."""
        if category not in self._models:
            self._models[category] = self._load(category)
        return self._models[category]

    # --- plans on the reference

    def plan(self, region: Painted, number: int) -> Plan | None:
        """A step's plan, None where it has not been made yet for what is painted and filled in."""
        kept = self._plans.get((region.name, number))
        basis = _basis(self.desk.document, region, number)
        return kept[1] if kept is not None and kept[0] == basis else None

    def planned(self, region: Painted) -> list[np.ndarray]:
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
            if self.desk.document.reference is not document.reference:
                return
            basis = _basis(document, region, number)
            self._plans[region.name, number] = basis, self._made(region, number)

    def _made(self, region: Painted, number: int) -> Plan:
        body = self.desk.body(REFERENCE)
        try:
            process = process_of(region, number)
        except ProcessError as error:
            return Plan(str(error))
        indices = np.flatnonzero(region.mask)
        checked = check_process(body.surface, region.name, indices, process, body.given)
        return Plan(f"{checked.where}: {checked.fault}" if checked.fault else "", checked)

    # --- targets

    def is_current(self, key: str) -> bool:
        """Whether a target's result is that of what is painted and filled in now."""
        result = self.results.get(key)
        return (
            result is not None
            and result.target is self.desk.target(key)
            and self._teacher is not None
            and result.teacher is self._teacher[1]
            and _same_lesson(self._teacher[0], self.desk.document)
        )

    def ready(self, key: str) -> Result:
        """A target's result. Raises ProcessError where there is none of what is painted now."""
        result = self.results.get(key)
        if result is None:
            raise ProcessError("nothing has been brought to a target yet: do so in step 4")
        if not self.is_current(key):
            raise ProcessError(
                f"what is on {key} is of before your last change: press 'Bring the process there' "
                "in step 4 first"
            )
        return result

    def transfer(self, document: Document, progress: Progress) -> None:
        """Bring the processes to every target whose result is not current.

        Raises NrdfError for a document that is not complete, naming region, field and value, and
        what `Teacher.transfer` raises, naming the target.
        """
        teacher = self._taught(document)
        targets = [t for t in document.targets if not self._has(t, teacher)]
        for done, target in enumerate(targets):
            self._transfer(target, teacher, _within(progress, done, len(targets)))

    def _has(self, target: Target, teacher: Teacher) -> bool:
        result = self.results.get(target.object.name)
        return result is not None and result.teacher is teacher and result.target is target

    def _taught(self, document: Document) -> Teacher:
        if self._teacher is None or not _same_lesson(self._teacher[0], document):
            lesson = lesson_of(self.desk.session, document)
            self._teacher = document, Teacher(lesson, self.model(document.category))
        return self._teacher[1]

    def _transfer(self, target: Target, teacher: Teacher, progress: Progress) -> None:
        progress(0, 1)
        name, earlier = target.object.name, self.results.get(target.object.name)
        try:
            if earlier is not None and earlier.embedded.cloud is target.object.cloud:
                embedded = earlier.embedded
            else:
                embedded = teacher.model.embed(target.object.cloud)
            marked = dict(target.corrected)
            transferred = teacher.transfer(embedded, marked=marked, progress=progress)
        except NrdfError as error:
            raise type(error)(f"target {name}: {error}") from None
        self.results[name] = Result(transferred, embedded, teacher, target)

    # --- likeness

    def described(self, document: Document, progress: Progress) -> Described:
        """What the descriptors of the reference and of every target with a result say, computed
        where it has changed."""
        teacher = self._taught(document)
        of: dict[str, tuple[Taught, Embedded]] = {
            REFERENCE: (teacher.taught, teacher.taught.reference)
        }
        of |= {key: (r.teacher.taught, r.embedded) for key, r in self.results.items()}
        kept = self._described
        for done, (key, (taught, embedded)) in enumerate(of.items()):
            progress(done, len(of))
            earlier = kept.get(key)
            if earlier is None or earlier[0] is not taught or earlier[1] is not embedded:
                kept[key] = (taught, embedded, taught.described(embedded))
        return Described({key: (kept[key][0], kept[key][2]) for key in of})


def _basis(document: Document, region: Painted, number: int) -> bytes:
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
