"""Process knowledge transferred to a new object: regions found, tool paths planned or warped.

A `ProcessTransfer` is knowledge on its reference, encoded once; `transfer` takes any number of
targets.

    process = nrdf.load_process("chair.yaml")
    result = process.transfer(nrdf.read_cloud("new.ply"))
    nrdf.write_job("job/", result)
"""

from __future__ import annotations

import logging
import os
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
from nrdf.geometry.polylines import longest_step
from nrdf.geometry.units import readable
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
from nrdf.process.process import Process, TaughtSegment
from nrdf.process.strategy import strategy_of, tool_path
from nrdf.process.taught_paths import contact_points, taught_segments
from nrdf.process.transfer_result import (
    MIN_CONFIDENCE,
    FoundRegion,
    PathResult,
    TransferResult,
    reason_to_skip,
)
from nrdf.process.warp import warp_segments
from nrdf.regions.match import Match
from nrdf.regions.model import Model, load_model
from nrdf.regions.region import region_indices
from nrdf.scans.kind_check import KindCheck
from nrdf.surface.given_surface import GivenSurface, given_surface, with_normals_of
from nrdf.surface.target_mesh import TargetMesh
from nrdf.toolpath.mesh_projection import on_mesh, target_mesh_of
from nrdf.toolpath.metrics import measure_path
from nrdf.toolpath.planner import plan
from nrdf.toolpath.tool_segments import add_approach_retract
from nrdf.toolpath.types import Segment

log = logging.getLogger(__name__)

_LONGER = 2.0  # times the longest step on the reference, from which a warped one is reported
_THREADS = 4  # that plan: numpy leaves them little to do at once


class ProcessTransfer:
    """Knowledge on its reference, as a model sees it.

    Raises ModelError for a model of another category.

    Attributes:
        bound_knowledge: the knowledge with its reference's cloud and regions.
        reference: that cloud, encoded.
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
        self._segments: dict[tuple[str, int], tuple[Segment, ...]] = {}

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
        matches = self.reference.retrieve_all(regions, encoded, check=False)
        matches |= _marked_matches(marked or {}, matches, encoded)
        found = {
            n: FoundRegion(n, m, reason_to_skip(m, min_confidence)) for n, m in matches.items()
        }
        seconds = {"regions": time.perf_counter() - start}
        start = time.perf_counter()
        correspondence = Correspondence(self.reference_surface, encoded)
        seconds["surface"] = time.perf_counter() - start
        start = time.perf_counter()
        cloud = with_normals(encoded)
        complete = cloud if whole is None else with_normals_of(whole, cloud)
        given, mesh = given_surface(complete), target_mesh_of(complete)
        paths = self._paths(found, correspondence, given, mesh, progress)
        seconds["tool paths"] = time.perf_counter() - start
        shared = overlaps({n: r.match.indices for n, r in found.items() if not r.missing})
        skipped = [
            f"region '{r.name}' is skipped: {r.missing}" for r in found.values() if r.missing
        ]
        return TransferResult(
            bound_knowledge=self.bound_knowledge,
            target=cloud,
            regions=found,
            paths=paths,
            warnings=(*skipped, *(line.split(";")[0] for line in shared)),
            seconds=seconds,
            pose=encoded.pose,
            target_warnings=tuple(target_warnings),
            kind=kind,
        )

    def steps(self) -> list[tuple[str, int, Process]]:
        """Every process with its region and number there, in the order in which they are done."""
        steps = [
            (region.name, number, process)
            for region in self.bound_knowledge.knowledge.regions
            for number, process in enumerate(region.steps)
        ]
        return sorted(steps, key=lambda step: step[2].order)

    def reference_segments(self, region: str, number: int) -> tuple[Segment, ...]:
        """The process segments of a process on the reference: as taught, or planned there."""
        if (region, number) not in self._segments:
            process, surface = self._process(region, number), self.reference_surface.surface
            if process.waypoints is not None:
                segments = taught_segments(process, surface)
            else:
                inside = self.reference.encoded_cloud.to_working(
                    self.bound_knowledge.regions[region]
                )
                once = replace(strategy_of(process), passes=1)
                segments = tuple(s for s in plan(surface, inside, once) if s.kind == "process")
            self._segments[region, number] = segments
        return self._segments[region, number]

    def reference_contacts(self, region: str, number: int) -> list[np.ndarray]:
        """The points (n, 3) of the reference's surface that each segment of a process works."""
        height = self._process(region, number).standoff_m
        segments = self.reference_segments(region, number)
        return [contact_points(s.positions, s.quaternions_xyzw, height) for s in segments]

    def _encode(self, target: Any, unit: str | None) -> tuple[EncodedCloud, Sequence[str]]:
        """The target encoded, in metres, and what is uncertain about its unit."""
        if isinstance(target, EncodedCloud):
            return self.reference.orient_sheets(self.bound_knowledge.regions, target), ()
        target = as_cloud(target, "the target")
        category = self.bound_knowledge.knowledge.category
        known, warnings = unit_and_warnings(target, unit, category, "the target", "unit")
        return self.model.encode(in_metres(target, known)), warnings

    def _process(self, region: str, number: int) -> Process:
        named = {r.name: r for r in self.bound_knowledge.knowledge.regions}
        return named[region].processes[number]

    def _paths(
        self,
        found: Mapping[str, FoundRegion],
        correspondence: Correspondence,
        given: GivenSurface,
        mesh: TargetMesh | None,
        progress: Callable[[int, int], None] | None,
    ) -> tuple[PathResult, ...]:
        """Every process on the target, planned by several threads."""
        correspondence.target_surface.edges  # noqa: B018, what all paths share
        steps, paths = self.steps(), []
        with ThreadPoolExecutor(min(_THREADS, os.cpu_count() or 1)) as pool:
            planned = [
                pool.submit(self._path, *step, found[step[0]], correspondence, given, mesh)
                for step in steps
            ]
            try:
                for done, path in enumerate(planned):
                    if progress is not None:
                        progress(done + 1, len(steps) + 1)
                    paths.append(path.result())
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                raise
        return tuple(paths)

    def _path(
        self,
        region: str,
        number: int,
        process: Process,
        found: FoundRegion,
        correspondence: Correspondence,
        given: GivenSurface,
        mesh: TargetMesh | None,
    ) -> PathResult:
        """One process on one region of the target."""
        made = PathResult(region, number, process, process.transfer_mode)
        if found.missing:
            return replace(made, reason=found.missing)
        surface = correspondence.target_surface
        inside = found.match.working
        if process.direction is not None:
            indices = self.bound_knowledge.regions[region]
            direction = correspondence.map_direction(indices, np.array(process.direction))
            process = process.model_copy(update={"direction": tuple(direction.tolist())})
        strategy = strategy_of(process)
        warnings: tuple[str, ...] = ()
        try:
            if process.transfer_mode == "replan":
                segments = on_mesh(plan(surface, inside, strategy), mesh, strategy)
            else:
                step = region, number, process, correspondence, mesh
                process, segments, warnings = self._warp(*step)
            metrics = measure_path(surface, inside, strategy, segments, given)
        except ProcessError as error:
            return replace(made, process=process, reason=str(error))
        path = tool_path(region, process, segments)
        return replace(made, process=process, path=path, metrics=metrics, warnings=warnings)

    def _warp(
        self,
        region: str,
        number: int,
        process: Process,
        correspondence: Correspondence,
        mesh: TargetMesh | None,
    ) -> tuple[Process, tuple[Segment, ...], tuple[str, ...]]:
        """A process with its waypoints warped to the target, its segments there, and warnings."""
        here = self.reference_segments(region, number)
        there, lost = warp_segments(correspondence, here, process.tool.radius_m)
        there = on_mesh(there, mesh, strategy_of(process))
        total = sum(len(segment.positions) for segment in here)
        if not there:
            raise ProcessError(f"none of the {total} waypoints has a place on the target")
        warnings = [f"{lost} of {total} waypoints have no place on the target"] if lost else []
        longest, warped = (max(longest_step(s.positions) for s in of) for of in (here, there))
        if warped > _LONGER * longest:
            warnings.append(
                f"a step of {readable('_m', warped)} between neighbouring waypoints; the longest "
                f"on the reference is {readable('_m', longest)}"
            )
        normals = [segment.normals for segment in there]
        segments = add_approach_retract(there, normals, strategy_of(process))
        waypoints = [
            TaughtSegment(
                positions_m=s.positions.tolist(), quaternions_xyzw=s.quaternions_xyzw.tolist()
            )
            for s in there
        ]
        changes = {"trajectory": "taught", "waypoints": waypoints, "transfer": None}
        return process.model_copy(update=changes), segments, tuple(warnings)


def load_process(knowledge: str | Path, model: Model | None = None) -> ProcessTransfer:
    """Process knowledge from its file, on its reference, ready to be transferred to targets.

    Args:
        knowledge: path of the knowledge file.
        model: the knowledge's category in the zoo unless given.

    Raises:
        ProcessError: knowledge is wrong somewhere; field and value are named.
        CloudError: the reference cannot be used.
        ModelError: the model is of another category.
    """
    bound_knowledge = read_bound_knowledge(knowledge)
    category = bound_knowledge.knowledge.category
    return ProcessTransfer(bound_knowledge, load_model(category) if model is None else model)


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


def with_normals(encoded: EncodedCloud) -> PointCloud:
    """The whole cloud of an encoded one, with the normals that the field works with."""
    if encoded.cloud.normals is not None:
        return encoded.cloud
    normals = encoded.original_normals(encoded.normals)
    return replace(encoded.cloud, normals=normals[encoded.nearest_working])
