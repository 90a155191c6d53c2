"""The paths of a knowledge on its own reference: as taught, or planned on the reference's mesh."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from threading import RLock

import numpy as np

from nrdf.errors import ProcessError
from nrdf.field.cloud_encoder import WORKING_POINTS
from nrdf.geometry.normals import estimate_normals
from nrdf.geometry.sampling import distinct_points, downsample, indices_in_subset
from nrdf.io.cloud import PointCloud
from nrdf.process.bound_knowledge import BoundKnowledge
from nrdf.process.object_regions import (
    ObjectSurface,
    Votes,
    object_surface,
    region_or_reason,
    regions_on,
)
from nrdf.process.process import Process
from nrdf.process.strategy import strategy_of
from nrdf.process.taught_paths import taught_segments
from nrdf.surface.given_surface import GivenSurface, given_surface, with_normals_of
from nrdf.surface.region_mesh import RegionMesh, RegionMeshes
from nrdf.toolpath.mesh_planner import plan_on_mesh
from nrdf.toolpath.tool_segments import contact_points
from nrdf.toolpath.types import Segment


class ReferencePaths:
    """A knowledge's reference as a mesh with its regions, and the paths there.

    Everything is made when it is first asked for, and kept.
    """

    def __init__(self, bound_knowledge: BoundKnowledge) -> None:
        self.bound_knowledge = bound_knowledge
        self._segments: dict[tuple[str, int], tuple[Segment, ...]] = {}
        self._lock = RLock()

    @cached_property
    def votes(self) -> Votes:
        """As many of the reference's points as a model works with, and their regions."""
        whole = self.bound_knowledge.cloud
        kept = downsample(whole.points, WORKING_POINTS, np.random.default_rng(0))
        points = whole.points[kept]
        normals = estimate_normals(points) if whole.normals is None else whole.normals[kept]
        distinct = distinct_points(points, normals)
        regions = {
            name: indices_in_subset(kept[distinct], indices, len(whole))
            for name, indices in self.bound_knowledge.regions.items()
        }
        return Votes(points[distinct], normals[distinct], regions)

    @cached_property
    def cloud(self) -> PointCloud:
        """The reference in metres, with normals."""
        votes = self.votes
        return with_normals_of(self.bound_knowledge.cloud, PointCloud(votes.points, votes.normals))

    @cached_property
    def surface(self) -> ObjectSurface:
        """The reference's mesh. Raises ProcessError where none can be made."""
        return object_surface(self.cloud, self.bound_knowledge.knowledge)

    @cached_property
    def given(self) -> GivenSurface:
        """The reference as the user gave it, which paths are compared with."""
        try:
            skin = self.surface.skin
        except ProcessError:
            skin = None
        return given_surface(self.cloud, skin)

    @cached_property
    def regions(self) -> RegionMeshes:
        """The regions on that mesh."""
        return regions_on(self.surface.mesh, self.votes, self.bound_knowledge.knowledge)

    def region(self, name: str) -> RegionMesh:
        """A region. Raises ProcessError, with the reason, where it has no mesh."""
        with self._lock:
            return region_or_reason(self.regions, name)

    def process(self, region: str, number: int) -> Process:
        """A process by its region and its number there."""
        named = {r.name: r for r in self.bound_knowledge.knowledge.regions}
        return named[region].processes[number]

    def segments(self, region: str, number: int) -> tuple[Segment, ...]:
        """The process segments of a process: as taught, or planned.

        Raises ProcessError where that cannot be done.
        """
        with self._lock:
            if (region, number) not in self._segments:
                process = self.process(region, number)
                if process.waypoints is not None:
                    segments = taught_segments(process, self.surface.mesh)
                else:
                    once = replace(strategy_of(process), passes=1)
                    planned = plan_on_mesh(self.region(region), once)
                    segments = tuple(s for s in planned if s.kind == "process")
                self._segments[region, number] = segments
            return self._segments[region, number]

    def contacts(self, region: str, number: int) -> list[np.ndarray]:
        """The points (n, 3), m, of the surface that each segment of a process works."""
        strategy = strategy_of(self.process(region, number))
        return [contact_points(segment, strategy) for segment in self.segments(region, number)]
