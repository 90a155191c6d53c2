"""Every process of a knowledge on a target: planned anew on its regions, or warped to them."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from nrdf.errors import ProcessError
from nrdf.geometry.polylines import longest_step
from nrdf.geometry.units import readable
from nrdf.process.correspondence import Correspondence
from nrdf.process.process import Process, TaughtSegment
from nrdf.process.reference_paths import ReferencePaths
from nrdf.process.result_target import plan_result, result_warnings, with_lines_of
from nrdf.process.strategy import strategy_of, tool_path
from nrdf.process.taught_paths import check_origin
from nrdf.process.transfer_result import FoundRegion, PathResult
from nrdf.process.warp import warp_segments
from nrdf.surface.given_surface import GivenSurface
from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.mesh_planner import plan_on_mesh
from nrdf.toolpath.mesh_projection import on_mesh
from nrdf.toolpath.metrics import measure_path
from nrdf.toolpath.tool_segments import add_approach_retract
from nrdf.toolpath.types import Segment

Step = tuple[str, int, Process]
"""A region's name, the number of a process there, and the process."""
_LONGER = 2.0  # times the longest step on the reference, from which a warped one is reported
_THREADS = 4  # that plan: numpy leaves them little to do at once


@dataclass(frozen=True)
class TargetPaths:
    """What all paths on one target share.

    given: the target as it was given, which paths are compared with. up: (3,) its upright axis.
    """

    reference: ReferencePaths
    correspondence: Correspondence
    given: GivenSurface
    up: np.ndarray

    def all(
        self,
        steps: Sequence[Step],
        found: Mapping[str, FoundRegion],
        progress: Callable[[int, int], None] | None = None,
    ) -> tuple[PathResult, ...]:
        """Every step on its region, planned by several threads.

        progress: called with (done, all) steps.
        """
        paths = []
        with ThreadPoolExecutor(min(_THREADS, os.cpu_count() or 1)) as pool:
            planned = [pool.submit(self.path, *step, found[step[0]]) for step in steps]
            try:
                for done, path in enumerate(planned):
                    if progress is not None:
                        progress(done + 1, len(steps) + 1)
                    paths.append(path.result())
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                raise
        return tuple(paths)

    def path(self, region: str, number: int, process: Process, found: FoundRegion) -> PathResult:
        """One process on one region of the target."""
        made = PathResult(region, number, process, process.transfer_mode)
        if found.missing or found.mesh is None:
            return replace(made, reason=found.missing)
        warnings: tuple[str, ...] = ()
        try:
            process, warnings = self._placed(region, process)
            strategy = strategy_of(process)
            if process.transfer_mode == "replan":
                segments = plan_on_mesh(found.mesh, strategy)
            else:
                process, segments, lost = self._warp(region, number, process, found.mesh)
                warnings += lost
            result = plan_result(found.mesh, process, segments, process.waypoints is None)
            if result is not None:
                process, segments = with_lines_of(process, result), result.segments
                strategy = strategy_of(process)
                warnings += tuple(result_warnings(process, result))
            metrics = measure_path(found.mesh, strategy, segments, self.given, self.up)
        except ProcessError as error:
            return replace(made, process=process, reason=str(error))
        path = tool_path(region, process, segments)
        return replace(
            made, process=process, path=path, metrics=metrics, warnings=warnings, result=result
        )

    def _placed(self, region: str, process: Process) -> tuple[Process, tuple[str, ...]]:
        """A process with its direction and origin as they are on the target, and warnings."""
        correspondence, changes = self.correspondence, dict[str, object]()
        warnings: tuple[str, ...] = ()
        if process.direction is not None:
            given = np.array(process.direction)
            if process.direction_mode == "fixed":
                direction = correspondence.turn_direction(given)
            else:
                indices = self.reference.bound_knowledge.regions[region]
                direction = correspondence.map_direction(indices, given)
            changes["direction"] = tuple(direction.tolist())
        if process.origin_m is not None:
            origin = np.array(process.origin_m)
            if process.origin_mode == "fixed":
                changes["origin_m"] = tuple(correspondence.move_point(origin).tolist())
            else:
                mesh = self.reference.region(region).mesh
                check_origin(process, mesh)
                near = mesh.nearest(origin[None])
                found, _, there = correspondence.map_points(near.points, near.normals)
                changes["origin_m"] = tuple(found[0].tolist()) if there[0] else None
                changes["origin_mode"] = process.origin_mode if there[0] else None
                if not there[0]:
                    warnings = (
                        "origin_m has no place on the target; the lines lie evenly between the "
                        "region's borders",
                    )
        return process.model_copy(update=changes), warnings

    def _warp(
        self, region: str, number: int, process: Process, mesh: RegionMesh
    ) -> tuple[Process, tuple[Segment, ...], tuple[str, ...]]:
        """A process with its waypoints warped to the target, its segments there, and warnings."""
        strategy = strategy_of(process)
        here = self.reference.segments(region, number)
        there, lost = warp_segments(self.correspondence, here, process.tool.radius_m)
        there = on_mesh(there, mesh.parent, strategy)
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
        segments = add_approach_retract(there, normals, strategy)
        waypoints = [
            TaughtSegment(
                positions_m=s.positions.tolist(), quaternions_xyzw=s.quaternions_xyzw.tolist()
            )
            for s in there
        ]
        changes = {"trajectory": "taught", "waypoints": waypoints, "transfer": None}
        return process.model_copy(update=changes), segments, tuple(warnings)
