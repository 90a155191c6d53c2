"""Every change of a session: load objects, paint regions, describe processes, correct."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import PurePath
from typing import Any

import numpy as np

from nrdf.errors import NrdfError, RegionError
from nrdf.io.cloud import PointCloud
from nrdf.io.file_names import safe_file_name
from nrdf.process.bound_knowledge import BoundKnowledge, overlaps
from nrdf.regions.region import region_name_fault
from nrdf.studio.model.document import (
    REFERENCE,
    Document,
    LoadedObject,
    PaintedRegion,
    Target,
)
from nrdf.studio.model.paintable_cloud import PaintableCloud
from nrdf.studio.model.placing import PlacedScan, Placement
from nrdf.studio.model.session import Session
from nrdf.studio.model.teaching import changed_step, new_step, painted_regions_of
from nrdf.studio.model.uploads import shown_name, thinned_reference
from nrdf.viz.palette import next_region_colour

_FIRST_KIND = "sand"


class Editor:
    """A session, its objects as paintable clouds, and every change that can be made.

    Raises what `Session` raises.
    """

    def __init__(self, session: Session) -> None:
        self.session = session
        self._paintables: dict[str, tuple[PointCloud, PaintableCloud]] = {}

    @property
    def document(self) -> Document:
        """The session's content."""
        return self.session.document

    def paintable(self, key: str) -> PaintableCloud:
        """The reference, or the target of that name."""
        cloud = self._cloud(key)
        kept = self._paintables.get(key)
        if kept is None or kept[0] is not cloud:
            kept = self._paintables[key] = (cloud, PaintableCloud(cloud))
        return kept[1]

    def object_keys(self) -> list[str]:
        """The keys of the reference, if there is one, and of the targets."""
        document = self.document
        first = [] if document.reference is None else [REFERENCE]
        return first + [target.object.name for target in document.targets]

    def target(self, key: str) -> Target | None:
        """The target of that name, None for the reference."""
        return next((t for t in self.document.targets if t.object.name == key), None)

    # --- objects

    def open_reference(
        self, name: str, cloud: PointCloud, category: str, model: str | None = None
    ) -> None:
        """Begin with a reference, in metres; earlier regions and targets are removed. model: that
        finds regions, instead of the category's."""
        loaded = self.session.store(shown_name(name), thinned_reference(cloud))
        self.session.change(Document(category, loaded, model=model))

    def open_knowledge(self, name: str, bound_knowledge: BoundKnowledge) -> None:
        """Begin with the content of a knowledge file, on its reference."""
        small = thinned_reference(bound_knowledge.cloud)
        if len(small) < len(bound_knowledge.cloud):
            raise RegionError(
                f"the reference has {len(bound_knowledge.cloud)} points; knowledge with more than "
                f"{len(small)} is for the command line"
            )
        loaded = self.session.store(shown_name(name), bound_knowledge.cloud)
        colours: dict[str, tuple[int, int, int]] = {}
        for region in bound_knowledge.knowledge.regions:
            colours[region.name] = next_region_colour(list(colours.values()))
        knowledge = bound_knowledge.knowledge
        regions = painted_regions_of(bound_knowledge, colours)
        self.session.change(
            Document(
                knowledge.category,
                loaded,
                regions,
                (),
                knowledge.allow_overlap,
                knowledge.model,
                knowledge.allow_unusual,
                knowledge.origin,
            )
        )

    def new_session(self) -> None:
        """Remove everything; undo brings it back."""
        self.session.change(Document(self.document.category, model=self.document.model))

    def add_target(self, name: str, cloud: PointCloud, placed: PlacedScan | None = None) -> str:
        """Add a target, in metres; its name. placed: the scan that it is of, unless it has +X
        forward and +Y up."""
        taken = [REFERENCE, *(t.object.name for t in self.document.targets)]
        name = _free(safe_file_name(PurePath(shown_name(name)).stem, "target"), taken)
        target = Target(self._stored(name, cloud, placed))
        document = self.document
        self.session.change(replace(document, targets=(*document.targets, target)))
        return name

    def place_target(self, key: str, placement: Placement) -> None:
        """Set how a target stands."""
        target = self.target(key)
        assert target is not None  # the page offers those that there are
        loaded = replace(target.object, placement=placement)
        self.session.change(self.document.with_target(key, object=loaded))

    def replace_target(self, key: str, placed: PlacedScan) -> None:
        """Replace what of its scan a target is. Corrections, which were of other points, go."""
        target = self.target(key)
        assert target is not None  # the page offers those that there are
        loaded = self._stored(key, placed.cloud, placed, target.object.scan)
        self.session.change(self.document.with_target(key, object=loaded, corrected={}))

    def _stored(
        self, name: str, cloud: PointCloud, placed: PlacedScan | None,
        scan: LoadedObject | None = None,
    ) -> LoadedObject:  # fmt: skip
        """An object in the session's folder, with the scan that it was cleaned out of."""
        loaded = self.session.store(name, cloud)
        if placed is None:
            return loaded
        if scan is None and len(placed.scan) > len(cloud):
            scan = self.session.store(f"{name} scan", placed.scan)
        return replace(loaded, placement=placed.placement, scan=scan)

    def remove_target(self, key: str) -> None:
        """Remove a target."""
        left = tuple(t for t in self.document.targets if t.object.name != key)
        self.session.change(replace(self.document, targets=left))

    # --- regions

    def add_region(self, name: str = "") -> str:
        """Add a region without points, with one process step; its name."""
        document = self.document
        taken = [region.name for region in document.regions]
        name = _free(name or "region", taken, always=not name)
        colour = next_region_colour([region.colour for region in document.regions])
        mask = np.zeros(len(self.paintable(REFERENCE).cloud), bool)
        added = PaintedRegion(name, colour, mask, (new_step(_FIRST_KIND),))
        self.session.change(replace(document, regions=(*document.regions, added)))
        return name

    def rename_region(self, old: str, new: str) -> None:
        """Raises RegionError for a name that is taken, or cannot be a file's name."""
        new = new.strip()
        if new == old:
            return
        if fault := region_name_fault(new):
            raise RegionError(f"'{new}' is no name for a region: {fault}")
        if self.document.region(new) is not None:
            raise RegionError(f"there is a region '{new}' already; give another name")
        document = self.document.with_region(old, called=new)
        for target in document.targets:
            corrected = {new if n == old else n: m for n, m in target.corrected.items()}
            document = document.with_target(target.object.name, corrected=corrected)
        self.session.change(document)

    def recolour_region(self, name: str, colour: tuple[int, int, int]) -> None:
        """Set a region's colour: red, green, blue, 0 to 255."""
        self.session.change(self.document.with_region(name, colour=colour))

    def remove_region(self, name: str) -> None:
        """Remove a region and its processes."""
        document = self.document
        left = tuple(region for region in document.regions if region.name != name)
        document = replace(document, regions=left)
        for target in document.targets:
            corrected = {n: m for n, m in target.corrected.items() if n != name}
            document = document.with_target(target.object.name, corrected=corrected)
        self.session.change(document)

    # --- painting

    def mask(self, key: str, region: str, found: np.ndarray | None = None) -> np.ndarray:
        """Which shown points (k,) of an object are in a region.

        As painted or corrected; else as `found`, the indices of a target's points.
        """
        paintable, target = self.paintable(key), self.target(key)
        if target is None:
            painted = self.document.region(region)
            whole = np.zeros(len(paintable.cloud), bool) if painted is None else painted.mask
        elif region in target.corrected:
            whole = target.corrected[region]
        else:
            whole = np.zeros(len(paintable.cloud), bool)
            whole[[] if found is None else found] = True
        return paintable.to_shown(whole)

    def paint(self, key: str, region: str, mask: np.ndarray, merge: bool = False) -> None:
        """Set a region to these shown points (k,); on a target that is a correction."""
        paintable, target = self.paintable(key), self.target(key)
        whole = paintable.to_all(mask)
        if target is None:
            document = self.document.with_region(region, mask=whole)
        else:
            document = self.document.with_target(key, corrected={**target.corrected, region: whole})
        self.session.change(document, merge)

    def discard_corrections(self, key: str) -> None:
        """Remove the regions painted by hand on a target."""
        self.session.change(self.document.with_target(key, corrected={}))

    def allow_overlap(self, allowed: bool) -> None:
        """Set whether regions may have points in common."""
        self.session.change(replace(self.document, allow_overlap=allowed))

    def overlaps(self) -> list[str]:
        """A sentence for each two regions that overlap by more than their borders."""
        regions = {r.name: np.flatnonzero(r.mask) for r in self.document.regions if r.mask.any()}
        return overlaps(regions)

    # --- processes

    def change_step(self, region: str, number: int, **content: Any) -> None:
        """Set fields of a step, SI; None removes a field."""
        step = {**self._step(region, number), **content}
        self._set_step(region, number, {k: v for k, v in step.items() if v is not None})

    def change_numbers(
        self, region: str, number: int, shown: Mapping[str, float], merge: bool = False
    ) -> None:
        """Set numbers of a step as the page shows them; merge: undone with the last change."""
        self._set_step(region, number, changed_step(self._step(region, number), shown), merge)

    def restart_step(self, region: str, number: int, kind: str) -> None:
        """Set another kind of process, with its usual values."""
        self._set_step(region, number, new_step(kind))

    def add_step(self, region: str, kind: str) -> int:
        """Add a process step to a region, after the others; its number."""
        painted = self._painted(region)
        steps = (*painted.steps, new_step(kind))
        self.session.change(self.document.with_region(region, steps=steps))
        return len(steps) - 1

    def remove_step(self, region: str, number: int) -> None:
        """Remove a process step. Raises RegionError for the only one: a region needs a process."""
        steps = self._painted(region).steps
        if len(steps) < 2:
            raise RegionError(f"region '{region}' needs at least one process; change this one")
        left = tuple(step for i, step in enumerate(steps) if i != number)
        self.session.change(self.document.with_region(region, steps=left))

    def _set_step(
        self, region: str, number: int, content: Mapping[str, Any], merge: bool = False
    ) -> None:
        steps = list(self._painted(region).steps)
        if content == steps[number]:
            return
        steps[number] = content
        self.session.change(self.document.with_region(region, steps=tuple(steps)), merge)

    def _step(self, region: str, number: int) -> Mapping[str, Any]:
        return self._painted(region).steps[number]

    def _painted(self, name: str) -> PaintedRegion:
        painted = self.document.region(name)
        if painted is None:
            raise RegionError("there is no region yet: make one in step 2")
        return painted

    def _cloud(self, key: str) -> PointCloud:
        target, reference = self.target(key), self.document.reference
        if target is not None:
            return target.object.cloud
        if key != REFERENCE or reference is None:
            raise NrdfError("there is no reference yet: load one in step 1")
        return reference.cloud


def _free(name: str, taken: list[str], always: bool = False) -> str:
    """The name, with a number where it is taken, or always."""
    name = re.sub(r"[^\w .+-]", "-", name)[:80]
    if not always and name not in taken:
        return name
    number = 1 if always else 2
    while f"{name}-{number}" in taken:
        number += 1
    return f"{name}-{number}"
