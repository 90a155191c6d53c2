"""Process knowledge transferred to a new object: regions found, tool paths planned or carried.

A `ProcessTransfer` is knowledge on its reference, embedded once; `transfer` takes any number of
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
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from nrdf.errors import ModelError, ProcessError, RegionError, unknown_name
from nrdf.field.encoded_cloud import EncodedCloud
from nrdf.geometry.similarity import Similarity
from nrdf.geometry.units import in_words
from nrdf.io.bounds import FRACTION
from nrdf.io.cloud import PointCloud, in_metres
from nrdf.io.inputs import as_cloud
from nrdf.process.bound_knowledge import (
    BoundKnowledge,
    overlaps,
    read_bound_knowledge,
    unit_and_warnings,
)
from nrdf.process.correspondence import Correspondence, TaughtSurface
from nrdf.process.knowledge import Process, TaughtSegment, TransferMode
from nrdf.process.strategy import strategy_of, tool_path
from nrdf.process.taught_paths import TaughtLine, taught_lines
from nrdf.process.warp import carry
from nrdf.regions.match import Match
from nrdf.regions.model import Model, load_model
from nrdf.regions.region import region_indices
from nrdf.scans.kind import KindCheck
from nrdf.surface.given_surface import GivenSurface, given_surface, with_normals_of
from nrdf.toolpath.metrics import Measures, measure
from nrdf.toolpath.planner import drive, plan
from nrdf.toolpath.types import Segment, ToolPath

log = logging.getLogger(__name__)

MIN_CONFIDENCE = 0.25
"""A region found with less mean confidence is skipped (docs/scans.md)."""
_LONGER = 2.0  # times the longest step on the reference, from which a carried one is said
_THREADS = 4  # that plan: numpy leaves them little to do at once


@dataclass(frozen=True)
class FoundRegion:
    """A region on the target: its match; `missing` says why it is skipped, "" where it is not."""

    name: str
    match: Match
    missing: str = ""


@dataclass(frozen=True)
class PathResult:
    """One process on one region of the target.

    number: which of the region's processes, from 0. process: as it is on the target (its
    direction, or its warped waypoints, in the target's frame). path, measures: None where there is
    no tool path; `reason` says why.
    """

    region: str
    number: int
    process: Process
    transfer_mode: TransferMode
    path: ToolPath | None = None
    measures: Measures | None = None
    warnings: tuple[str, ...] = ()
    reason: str = ""


@dataclass(frozen=True)
class TransferResult:
    """Everything on one target, in metres in its own frame; paths in the order they are driven.

    target: with normals, estimated where its file had none. seconds: time by phase. pose: from
    canonical coordinates to the target's: how the object lies there. target_warnings: about the
    target's pose and unit. kind: what it looks like. All warnings that `--strict` refuses:
    `nrdf.process.limits.strict_warnings`.
    """

    bound_knowledge: BoundKnowledge
    target: PointCloud
    regions: dict[str, FoundRegion]
    paths: tuple[PathResult, ...]
    warnings: tuple[str, ...]
    seconds: dict[str, float]
    pose: Similarity | None = None
    target_warnings: tuple[str, ...] = ()
    kind: KindCheck | None = None


class ProcessTransfer:
    """Knowledge on its reference, as a model sees it.

    Raises ModelError for a model of another category.
    """

    def __init__(self, bound_knowledge: BoundKnowledge, model: Model) -> None:
        category = bound_knowledge.knowledge.category
        if model.category and model.category != category:
            raise ModelError(
                f"the model is for the category {model.category}, but the knowledge is about a "
                f"{category}; give a model for {category}"
            )
        self.bound_knowledge, self.model = bound_knowledge, model
        self.taught = model.set_reference(bound_knowledge.cloud)
        self.reference = TaughtSurface(self.taught)
        self.surface = self.reference.surface
        self._lines: dict[tuple[str, int], tuple[TaughtLine, ...]] = {}

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

        target: what `nrdf.as_cloud` takes (a PointCloud, a path, an array (n, 3), a mesh), in the
        category's orientation, or embedded in any pose, in metres. unit: of the
        target, where its file did not say. A region that is found nowhere, or with
        less mean confidence than `min_confidence`, is skipped; a process that does not fit its
        region there is left out with the reason. marked: regions that a person has marked on the
        target, by name, as `region_indices` takes them, points in metres; they are taken as they
        are, and a mask that is False everywhere says that the region is not there. `progress` is
        told (done, all) steps. target_warnings: warnings about the target's pose and unit; unless
        given, its unit is checked here, and warnings are logged. whole: the
        target before it was thinned, in metres, by which tool paths are judged. kind: what the
        target was found to look like; it is checked here unless given. Raises
        CloudError for a target that cannot be used, ProcessError for one whose unit nothing tells,
        RegionError for a marked region that is not taught or not on the target, ConfigError for a
        `min_confidence` that is no share.
        """
        FRACTION.check("min_confidence", min_confidence)
        start = time.perf_counter()
        unit_warnings: Sequence[str] = ()
        if isinstance(target, EncodedCloud):
            embedded = self.taught.facing(self.bound_knowledge.regions, target)
        else:
            target = as_cloud(target, "the target")
            category = self.bound_knowledge.knowledge.category
            known, unit_warnings = unit_and_warnings(target, unit, category, "the target", "unit")
            embedded = self.model.encode(in_metres(target, known))
        if kind is None:
            kind = self.taught.check_kind(embedded)
        if target_warnings is None:
            target_warnings = unit_warnings
            for warning in (*unit_warnings, *kind.warnings):
                log.warning("%s", warning)
        matches = self.taught.retrieve_all(self.bound_knowledge.regions, embedded, check=False)
        matches |= self._marked(marked or {}, matches, embedded.cloud)
        found = {n: FoundRegion(n, m, _missing(m, min_confidence)) for n, m in matches.items()}
        seconds = {"regions": time.perf_counter() - start}
        start = time.perf_counter()
        way = Correspondence(self.reference, embedded)
        seconds["surface"] = time.perf_counter() - start
        start = time.perf_counter()
        way.target.edges  # noqa: B018, what all paths share
        cloud = with_normals(embedded)
        given = given_surface(cloud if whole is None else with_normals_of(whole, cloud))
        steps, paths = self.steps(), []
        with ThreadPoolExecutor(min(_THREADS, os.cpu_count() or 1)) as pool:
            planned = [pool.submit(self._path, *step, found[step[0]], way, given) for step in steps]
            try:
                for done, path in enumerate(planned):
                    if progress is not None:
                        progress(done + 1, len(steps) + 1)
                    paths.append(path.result())
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                raise
        seconds["tool paths"] = time.perf_counter() - start
        shared = overlaps({n: r.match.indices for n, r in found.items() if not r.missing})
        skipped = [
            f"region '{r.name}' is skipped: {r.missing}" for r in found.values() if r.missing
        ]
        warnings = (*skipped, *(line.split(";")[0] for line in shared))
        made, pose, about_target = tuple(paths), embedded.pose, tuple(target_warnings)
        return TransferResult(
            self.bound_knowledge, cloud, found, made, warnings, seconds, pose, about_target, kind
        )

    def _marked(
        self, marked: Mapping[str, ArrayLike], found: Mapping[str, Match], target: PointCloud
    ) -> dict[str, Match]:
        """Matches of regions that a person has marked on the target, with confidence 1."""
        matches = {}
        for name, region in marked.items():
            if name not in found:
                raise RegionError(unknown_name("taught region", name, list(found)))
            values = np.asarray(region)
            try:
                absent = values.dtype == bool and len(values) == len(target) and not values.any()
                indices = np.arange(0) if absent else np.unique(region_indices(values, target))
            except RegionError as error:
                raise RegionError(f"region '{name}' on the target: {error}") from None
            matches[name] = Match(indices, found[name].points, np.ones(len(indices)), "marked")
        return matches

    def steps(self) -> list[tuple[str, int, Process]]:
        """Every process with its region and number there, in the order in which they are done."""
        steps = [
            (region.name, number, process)
            for region in self.bound_knowledge.knowledge.regions
            for number, process in enumerate(region.steps)
        ]
        return sorted(steps, key=lambda step: step[2].order)

    def lines(self, region: str, number: int) -> tuple[TaughtLine, ...]:
        """The lines on the reference of a process: as taught, or planned there."""
        if (region, number) not in self._lines:
            process = self._process(region, number)
            if process.waypoints is not None:
                lines = taught_lines(process, self.surface)
            else:
                inside = working(self.taught.reference, self.bound_knowledge.regions[region])
                once = replace(strategy_of(process), passes=1)
                segments = plan(self.surface, inside, once)
                lines = tuple(
                    TaughtLine(s.positions, s.quaternions_xyzw) for s in segments
                    if s.kind == "process"
                )  # fmt: skip
            self._lines[region, number] = lines
        return self._lines[region, number]

    def contacts(self, region: str, number: int) -> list[np.ndarray]:
        """The places (n, 3) on the reference's surface that each line of a process works."""
        height = self._process(region, number).standoff_m
        lines = self.lines(region, number)
        return [touched(line.positions, line.quaternions_xyzw, height) for line in lines]

    def _process(self, region: str, number: int) -> Process:
        named = {r.name: r for r in self.bound_knowledge.knowledge.regions}
        return named[region].processes[number]

    def _path(
        self,
        region: str,
        number: int,
        process: Process,
        found: FoundRegion,
        way: Correspondence,
        given: GivenSurface,
    ) -> PathResult:
        made = PathResult(region, number, process, process.transfer_mode)
        if found.missing:
            return replace(made, reason=found.missing)
        inside = working(way.embedded, found.match.indices)
        if process.direction is not None:
            direction = way.direction(
                self.bound_knowledge.regions[region], np.array(process.direction)
            )
            process = process.model_copy(update={"direction": tuple(direction.tolist())})
        strategy = strategy_of(process)
        warnings: tuple[str, ...] = ()
        try:
            if process.transfer_mode == "replan":
                segments = plan(way.target, inside, strategy)
            else:
                process, segments, warnings = self._carry(region, number, process, way)
            figures = measure(way.target, inside, strategy, segments, given)
        except ProcessError as error:
            return replace(made, process=process, reason=str(error))
        path = tool_path(region, process, segments)
        return replace(made, process=process, path=path, measures=figures, warnings=warnings)

    def _carry(
        self, region: str, number: int, process: Process, way: Correspondence
    ) -> tuple[Process, tuple[Segment, ...], tuple[str, ...]]:
        lines = self.lines(region, number)
        carried, lost = carry(way, lines, process.tool.radius_m)
        total = sum(len(line.positions) for line in lines)
        if not carried:
            raise ProcessError(f"none of the {total} waypoints has a place on the target")
        warnings = [f"{lost} of {total} waypoints have no place on the target"] if lost else []
        here, there = (max(longest_step(line.positions) for line in of) for of in (lines, carried))
        if there > _LONGER * here:
            warnings.append(
                f"a step of {in_words('_m', there)} between neighbouring waypoints; the longest "
                f"on the reference is {in_words('_m', here)}"
            )
        drawn = [(line.positions, line.quaternions_xyzw) for line in carried]
        normals = [line.normals for line in carried]
        segments = drive(drawn, normals, strategy_of(process))
        waypoints = [
            TaughtSegment(positions_m=p.tolist(), quaternions_xyzw=q.tolist()) for p, q in drawn
        ]
        changes = {"trajectory": "taught", "waypoints": waypoints, "transfer": None}
        return process.model_copy(update=changes), segments, tuple(warnings)


def load_process(knowledge: str | Path, model: Model | None = None) -> ProcessTransfer:
    """Process knowledge from its file, on its reference, ready to be transferred to targets.

    `model` is the knowledge's category in the zoo unless given. Raises ProcessError for knowledge
    that is wrong somewhere, naming field and value, CloudError for a reference that cannot be used,
    and ModelError for a model of another category.
    """
    bound_knowledge = read_bound_knowledge(knowledge)
    category = bound_knowledge.knowledge.category
    return ProcessTransfer(bound_knowledge, load_model(category) if model is None else model)


def touched(positions: np.ndarray, quaternions_xyzw: np.ndarray, standoff_m: float) -> np.ndarray:
    """The places (n, 3) that tools at positions (n, 3), some height over a surface, point at."""
    along = Rotation.from_quat(quaternions_xyzw).as_matrix()[:, :, 2]
    return np.asarray(positions + standoff_m * along)


def longest_step(positions: np.ndarray) -> float:
    """The longest way between neighbours of positions (n, 3)."""
    return float(np.linalg.norm(np.diff(positions, axis=0), axis=1).max(initial=0.0))


def with_normals(embedded: EncodedCloud) -> PointCloud:
    """The whole cloud with the normals that the field works with."""
    if embedded.cloud.normals is not None:
        return embedded.cloud
    normals = embedded.original_normals(embedded.normals)
    return replace(embedded.cloud, normals=normals[embedded.nearest_working])


def working(embedded: EncodedCloud, indices: np.ndarray) -> np.ndarray:
    """Indices of a cloud's points as indices of the points that the field works on."""
    inside = np.zeros(len(embedded.cloud), bool)
    inside[indices] = True
    return np.flatnonzero(inside[embedded.working])


def _missing(match: Match, min_confidence: float) -> str:
    if match.presence.reason:
        return f"{match.presence.reason} (confidence {match.presence.confidence:.2f})"
    if not len(match.indices) and match.method == "marked":
        return "marked as not there"
    if not len(match.indices):
        return "found nowhere on the target"
    if match.score < min_confidence:
        return f"confidence {match.score:.2f}, below {min_confidence:g}"
    return ""
