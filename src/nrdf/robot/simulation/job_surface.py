"""The surfaces of a job: its object as it was given, as it was planned on, and its regions.

What is simulated is the object that was given. The mesh that paths were planned on only tells the
force control what to expect: judged by it, a plan would be judged by itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from nrdf.errors import ProcessError
from nrdf.process.bound_knowledge import BoundKnowledge
from nrdf.reports.job_meshes import SURFACE, read_job_meshes
from nrdf.surface.object_mesh import object_mesh
from nrdf.surface.region_mesh import RegionMesh, region_meshes
from nrdf.surface.target_mesh import TargetMesh

_SAME = 1e-5  # share of an object's size within which a mesh goes through all points given of it
_FINE_M = 1e-4  # no tool's radius: as fine as the points are


@dataclass(frozen=True)
class JobSurfaces:
    """given: the object's mesh as the user gave it, or of all points that the user gave. planned:
    the mesh that paths were planned on. regions: name to mesh, whose parent is `given`. All in
    metres, in the job's frame. origin: what `given` is, in words; exact: whether it is a mesh that
    the user gave."""

    given: TargetMesh
    planned: TargetMesh
    regions: dict[str, RegionMesh]
    origin: str
    exact: bool

    def with_mesh(self, mesh: TargetMesh, origin: str) -> JobSurfaces:
        """The same with another mesh of the object as the one that was given."""
        regions = {name: replace(region, parent=mesh) for name, region in self.regions.items()}
        return JobSurfaces(mesh, self.planned, regions, origin, True)


def read_job_surfaces(
    folder: Path, bound_knowledge: BoundKnowledge, tool_radius_m: Mapping[str, float]
) -> JobSurfaces:
    """The surfaces of a job's folder.

    tool_radius_m: of each region that is worked, the smallest. A folder without meshes, as an
    earlier nrdf wrote it, has them made of its points. Raises ProcessError where that is not
    possible, or a mesh is not that of the points.
    """
    cloud = bound_knowledge.cloud
    if (folder / SURFACE).is_file():
        read = read_job_meshes(folder)
        planned, regions = read.surface, dict(read.regions)
        if missing := sorted(set(tool_radius_m) - set(regions)):
            raise ProcessError(
                f"{folder} has no mesh of the region '{missing[0]}', which a tool path is on; "
                "transfer it again"
            )
    else:
        planned = object_mesh(cloud, min(tool_radius_m.values()))
        regions = _regions_of_points(bound_knowledge, planned, tool_radius_m)
    if cloud.mesh is not None:
        given, origin, exact = TargetMesh.from_mesh(cloud.mesh), "the mesh that was given", True
    elif _goes_through(planned, cloud.points):
        given, origin, exact = planned, "the mesh that was given", True
    else:
        given, exact = object_mesh(cloud, _FINE_M), False
        origin = f"a mesh of all {len(cloud.points)} points that were given"
    regions = {name: replace(region, parent=given) for name, region in regions.items()}
    return JobSurfaces(given, planned, regions, origin, exact)


def _goes_through(mesh: TargetMesh, points: np.ndarray) -> bool:
    """Whether a mesh goes through all points (n, 3), as only the mesh does that they are of: one
    made of points evens them out."""
    return bool(mesh.nearest(points).distances.max() <= _SAME * mesh.size)


def _regions_of_points(
    bound_knowledge: BoundKnowledge, surface: TargetMesh, tool_radius_m: Mapping[str, float]
) -> dict[str, RegionMesh]:
    """The regions that were worked, cut out of a surface around their points."""
    cloud, memberships = bound_knowledge.cloud, {}
    assert cloud.normals is not None
    for name in tool_radius_m:
        memberships[name] = np.zeros(len(cloud.points))
        memberships[name][bound_knowledge.regions[name]] = 1.0
    found = region_meshes(
        surface, cloud.points, cloud.normals, memberships, dict(tool_radius_m), allow_overlap=True
    )
    for name, reason in found.left_out.items():
        raise ProcessError(
            f"the job has no meshes, and none can be made of its region '{name}': {reason} "
            "Transfer it again"
        )
    return found.found
