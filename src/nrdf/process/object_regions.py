"""An object's mesh with its regions on it: what the processes of a knowledge are planned on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from nrdf.errors import ProcessError
from nrdf.io.cloud import PointCloud
from nrdf.process.knowledge import Knowledge
from nrdf.surface.object_mesh import object_mesh
from nrdf.surface.region_mesh import RegionMesh, RegionMeshes, region_meshes
from nrdf.surface.target_mesh import TargetMesh


@dataclass(frozen=True)
class Votes:
    """Points (n, 3), m, of a whole object with outward normals (n, 3), and which of them each
    region has: name to indices (k,)."""

    points: np.ndarray
    normals: np.ndarray
    regions: Mapping[str, np.ndarray]


@dataclass(frozen=True)
class ObjectSurface:
    """mesh: the object's own, or made of its points. skin: the same where it is the object's own,
    else None. warnings: why it is not the one given."""

    mesh: TargetMesh
    skin: TargetMesh | None = None
    warnings: tuple[str, ...] = ()


def object_surface(cloud: PointCloud, knowledge: Knowledge) -> ObjectSurface:
    """The mesh of a cloud in metres, with normals, for the smallest tool of a knowledge.

    A mesh that cannot be used is replaced by one made of the cloud's points, which is said. Raises
    ProcessError where that cannot be made either.
    """
    radius = min(min(radii) for radii in _radii(knowledge).values())
    if cloud.mesh is None:
        return ObjectSurface(object_mesh(cloud, radius))
    try:
        skin = object_mesh(cloud, radius)
        return ObjectSurface(skin, skin)
    except ProcessError as error:
        made = object_mesh(replace(cloud, mesh=None), radius)
        said = f"the mesh as given is not used, but one made of its points: {error}"
        return ObjectSurface(made, warnings=(said,))


def regions_on(mesh: TargetMesh, votes: Votes, knowledge: Knowledge) -> RegionMeshes:
    """The regions of a knowledge on an object's mesh, by the votes of its points.

    Each is cut for the smallest of its tools. Regions without votes are in neither of the two.
    """
    memberships = {}
    for name, indices in votes.regions.items():
        memberships[name] = np.zeros(len(votes.points))
        memberships[name][indices] = 1.0
    radii = _radii(knowledge)
    return region_meshes(
        mesh,
        votes.points,
        votes.normals,
        memberships,
        {name: min(radii[name]) for name in memberships},
        fill_holes=[region.name for region in knowledge.regions if region.fill_holes],
        allow_overlap=knowledge.allow_overlap,
    )


def region_or_reason(found: RegionMeshes, name: str) -> RegionMesh:
    """A region that was found. Raises ProcessError with the reason for one that was not."""
    if name not in found.found:
        raise ProcessError(reason(found.left_out.get(name, "It has no points.")))
    return found.found[name]


def reason(sentence: str) -> str:
    """A sentence as it stands after a colon."""
    return f"{sentence[:1].lower()}{sentence[1:]}".rstrip(".")


def _radii(knowledge: Knowledge) -> dict[str, Sequence[float]]:
    """The radii of each region's tools, m."""
    return {r.name: [p.tool.radius_m for p in r.processes] for r in knowledge.regions}
