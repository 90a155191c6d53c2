"""Process knowledge transferred to a new object: regions found, tool paths planned or warped.

A `ProcessTransfer` is knowledge on its reference, encoded once; `transfer` takes any number of
targets.

    process = nrdf.load_process("chair.yaml")
    result = process.transfer(nrdf.read_cloud("new.ply"))
    nrdf.write_job("job/", result)
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from nrdf.errors import ModelError, ProcessError, RegionError, unknown_name
from nrdf.field.encoded_cloud import EncodedCloud
from nrdf.io.bounds import FRACTION
from nrdf.io.cloud import PointCloud, in_metres
from nrdf.io.inputs import as_cloud
from nrdf.process.bound_knowledge import (
    BoundKnowledge,
    overlaps,
    read_bound_knowledge,
    unit_and_warnings,
)
from nrdf.process.correspondence import Correspondence, ReferenceSurface
from nrdf.process.model_choice import model_name_for
from nrdf.process.object_regions import ObjectSurface, Votes, object_surface, reason, regions_on
from nrdf.process.reference_paths import ReferencePaths
from nrdf.process.target_paths import Step, TargetPaths
from nrdf.process.transfer_result import (
    MIN_CONFIDENCE,
    FoundRegion,
    TransferResult,
    reason_to_skip,
)
from nrdf.regions.match import Match
from nrdf.regions.model import Model, load_model
from nrdf.regions.region import region_indices
from nrdf.scans.kind_check import KindCheck
from nrdf.surface.given_surface import GivenSurface, given_surface, with_normals_of
from nrdf.toolpath.types import Segment

log = logging.getLogger(__name__)


class ProcessTransfer:
    """Knowledge on its reference, as a model sees it.

    Raises ModelError for a model of another category.

    Attributes:
        bound_knowledge: the knowledge with its reference's cloud and regions.
        reference: that cloud, encoded.
        reference_paths: its mesh and regions, and the paths on them.
    """

    def __init__(self, bound_knowledge: BoundKnowledge, model: Model) -> None:
        category = bound_knowledge.knowledge.category
        if model.category and model.category != category:
            raise ModelError(
                f"the model is for the category {model.category}, but the knowledge is about a "
                f"{category}; give a model for {category}"
            )
        self.bound_knowledge, self.model = bound_knowledge, model
        self.reference = model.set_reference(bound_knowledge.cloud)
        self.reference_surface = ReferenceSurface(self.reference)
        self.reference_paths = ReferencePaths(bound_knowledge)

    def transfer(
        self,
        target: Any,
        unit: str | None = None,
        min_confidence: float = MIN_CONFIDENCE,
        marked: Mapping[str, ArrayLike] | None = None,
        progress: Callable[[int, int], None] | None = None,
        target_warnings: Sequence[str] | None = None,
        whole: PointCloud | None = None,
        kind: KindCheck | None = None,
        given: GivenSurface | None = None,
    ) -> TransferResult:
        """Find the regions on a target, and bring every process there.

        Args:
            target: what `nrdf.as_cloud` takes (a PointCloud, a path, an array (n, 3), a mesh), in
                the category's orientation, or an EncodedCloud in any pose, in metres.
            unit: of the target, where its file did not say.
            min_confidence: a region that is found nowhere, or with less mean confidence, is
            skipped.
                A process that does not fit its region on the target is left out, with the reason.
            marked: regions that a person has marked on the target, by name, as `region_indices`
            takes
                them, points in metres. They are taken as they are. A mask that is False everywhere
                says that the region is not there.
            progress: called with (done, all) steps.
            target_warnings: what is uncertain about the target's pose and unit. Unless given, its
                unit is checked here, and logged as a warning where it is uncertain.
            whole: the target before it was thinned, in metres, which tool paths are compared with.
            kind: what the target was found to look like; checked here unless given.
            given: what the tool paths are compared with, and nothing is planned on; the target as
                it was given, unless given.

        Raises:
            CloudError: the target cannot be used.
            ProcessError: the target's unit is not known.
            RegionError: a marked region is not taught, or not on the target.
            ConfigError: `min_confidence` is no share.
        """
        FRACTION.check("min_confidence", min_confidence)
        start = time.perf_counter()
        regions = self.bound_knowledge.regions
        encoded, unit_warnings = self._encode(target, unit)
        if kind is None:
            kind = self.reference.check_kind(encoded)
        if target_warnings is None:
            target_warnings = unit_warnings
            for warning in (*unit_warnings, *kind.warnings):
                log.warning("%s", warning)
        with ThreadPoolExecutor(2) as pool:
            meshing = pool.submit(_mesh_or_reason, encoded, whole, self.bound_knowledge)
            matches = self.reference.retrieve_all(regions, encoded, check=False)
            matches |= _marked_matches(marked or {}, matches, encoded)
            found = {
                n: FoundRegion(n, m, reason_to_skip(m, min_confidence)) for n, m in matches.items()
            }
            seconds = {"regions": time.perf_counter() - start}
            start = time.perf_counter()
            complete, surface, fault = meshing.result()
            skin = None if surface is None else surface.skin
            comparing = pool.submit(lambda: given or given_surface(complete, skin))
            found = self._on_mesh(found, encoded, surface, fault)
            compared = comparing.result()
        cloud = complete if whole is None else with_normals_of(encoded.cloud, complete)
        seconds["surface"] = time.perf_counter() - start
        start = time.perf_counter()
        correspondence = Correspondence(self.reference_surface, encoded)
        up = np.eye(3)[1] if encoded.pose is None else encoded.pose.rotation[:, 1]
        target_paths = TargetPaths(self.reference_paths, correspondence, compared, up)
        paths = target_paths.all(self.steps(), found, progress)
        seconds["tool paths"] = time.perf_counter() - start
        shared = overlaps({n: r.match.indices for n, r in found.items() if not r.missing})
        skipped = [
            f"region '{r.name}' is skipped: {r.missing}" for r in found.values() if r.missing
        ]
        said = () if surface is None else surface.warnings
        return TransferResult(
            bound_knowledge=self.bound_knowledge,
            target=cloud,
            regions=found,
            paths=paths,
            warnings=(*said, *skipped, *(line.split(";")[0] for line in shared)),
            seconds=seconds,
            pose=encoded.pose,
            target_warnings=tuple(target_warnings),
            kind=kind,
            surface=None if surface is None else surface.mesh,
        )

    def steps(self) -> list[Step]:
        """Every process with its region and number there, in the order in which they are done."""
        steps = [
            (region.name, number, process)
            for region in self.bound_knowledge.knowledge.regions
            for number, process in enumerate(region.steps)
        ]
        return sorted(steps, key=lambda step: step[2].order)

    def reference_segments(self, region: str, number: int) -> tuple[Segment, ...]:
        """The process segments of a process on the reference: as taught, or planned there."""
        return self.reference_paths.segments(region, number)

    def reference_contacts(self, region: str, number: int) -> list[np.ndarray]:
        """The points (n, 3) of the reference's surface that each segment of a process works."""
        return self.reference_paths.contacts(region, number)

    def _encode(self, target: Any, unit: str | None) -> tuple[EncodedCloud, Sequence[str]]:
        """The target encoded, in metres, and what is uncertain about its unit."""
        if isinstance(target, EncodedCloud):
            return self.reference.orient_sheets(self.bound_knowledge.regions, target), ()
        target = as_cloud(target, "the target")
        category = self.bound_knowledge.knowledge.category
        known, warnings = unit_and_warnings(target, unit, category, "the target", "unit")
        return self.model.encode(in_metres(target, known)), warnings

    def _on_mesh(
        self,
        found: Mapping[str, FoundRegion],
        encoded: EncodedCloud,
        surface: ObjectSurface | None,
        fault: str,
    ) -> dict[str, FoundRegion]:
        """The regions with their meshes, or why they have none."""
        there = {name: r.match.working for name, r in found.items() if not r.missing}
        if surface is None:
            return {n: replace(r, missing=r.missing or fault) for n, r in found.items()}
        points, normals = (
            encoded.original(encoded.points),
            encoded.original_normals(encoded.normals),
        )
        votes = Votes(points, normals, there)
        meshes = regions_on(surface.mesh, votes, self.bound_knowledge.knowledge)
        placed = dict(found)
        for name in there:
            missing = reason(meshes.left_out.get(name, ""))
            placed[name] = replace(found[name], missing=missing, mesh=meshes.found.get(name))
        return placed


def _mesh_or_reason(
    encoded: EncodedCloud, whole: PointCloud | None, bound_knowledge: BoundKnowledge
) -> tuple[PointCloud, ObjectSurface | None, str]:
    """All points of a target with normals, by those that the field works with; the target's mesh,
    or why there is none."""
    few = PointCloud(
        encoded.original(encoded.points), encoded.original_normals(encoded.normals), unit="m"
    )
    complete = with_normals_of(encoded.cloud if whole is None else whole, few)
    try:
        return complete, object_surface(complete, bound_knowledge.knowledge), ""
    except ProcessError as error:
        return complete, None, str(error)


def load_process(knowledge: str | Path, model: Model | None = None) -> ProcessTransfer:
    """Process knowledge from its file, on its reference, ready to be transferred to targets.

    Args:
        knowledge: path of the knowledge file.
        model: the one that the knowledge names, or its category's, unless given; the general
            one where the category has none (`nrdf.process.model_choice`).

    Raises:
        ProcessError: knowledge is wrong somewhere; field and value are named.
        CloudError: the reference cannot be used.
        ModelError: the model is of another category.
    """
    bound_knowledge = read_bound_knowledge(knowledge)
    if model is None:
        model = load_model(model_name_for(bound_knowledge.knowledge))
    return ProcessTransfer(bound_knowledge, model)


def _marked_matches(
    marked: Mapping[str, ArrayLike], found: Mapping[str, Match], encoded: EncodedCloud
) -> dict[str, Match]:
    """Matches of regions that a person has marked on the target: they are certain."""
    matches, target = {}, encoded.cloud
    for name, region in marked.items():
        if name not in found:
            raise RegionError(unknown_name("taught region", name, list(found)))
        values = np.asarray(region)
        try:
            absent = values.dtype == bool and len(values) == len(target) and not values.any()
            indices = np.arange(0) if absent else np.unique(region_indices(values, target))
        except RegionError as error:
            raise RegionError(f"region '{name}' on the target: {error}") from None
        matches[name] = Match(
            indices=indices,
            points=found[name].points,
            confidence=np.ones(len(indices)),
            method="marked",
            working=encoded.to_working(indices),
        )
    return matches
