"""What a region of a given mesh is like, and how like it a found one is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from nrdf.geometry.mesh import Mesh
from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.target_mesh import TargetMesh
from nrdf_benchmark.mesh_paths.targets import MeshTarget

_NEXT = 3.0  # times the points' spacing: points of one part
_ALIKE = 0.5  # cosine between normals of one side
_FLAT = float(np.radians(3.0))  # a side that bends less under the tool is flat
_ON_M = 2e-3  # of a found region's mesh: a point that is nearer lies on it
_ASKED = 400  # points at which it is asked how far a region bends


def parts_in_space(points: np.ndarray, point_area_m2: float, radius_m: float) -> int:
    """How many parts points (n, 3) of a surface fall into, those below a footprint left out; at
    least 1. Points stand for an area each; seams of the mesh part nothing."""
    near = cKDTree(points).query_pairs(_NEXT * float(np.sqrt(point_area_m2)), output_type="ndarray")
    count = len(points)
    net = coo_matrix((np.ones(len(near), bool), tuple(near.T)), (count, count))
    size = np.bincount(connected_components(net, directed=False)[1])
    return max(int((size * point_area_m2 >= np.pi * radius_m**2).sum()), 1)


def is_curved(points: np.ndarray, normals: np.ndarray, radius_m: float) -> bool:
    """Whether the surface at points (n, 3) with normals (n, 3) bends under the tool, edges left
    out: the median place turns more than 3 degrees from the mean within the tool's radius."""
    asked = np.unique(np.linspace(0, len(points) - 1, _ASKED).astype(int))
    turn = []
    for k, near in zip(
        asked, cKDTree(points).query_ball_point(points[asked], radius_m), strict=True
    ):
        facing = normals[near] @ normals[k]
        turn.append(float(np.mean(np.arccos(np.clip(facing[facing > _ALIKE], -1.0, 1.0)))))
    return float(np.median(turn)) > _FLAT


@dataclass(frozen=True)
class RegionMatch:
    """A found region beside the given one. inside: which of the given one's visible points (n,) it
    has; border_ratio: of the borders' lengths; iou: of the areas."""

    inside: np.ndarray
    border_ratio: float | None = None
    iou: float | None = None

    @staticmethod
    def of(target: MeshTarget, region: str, planned: RegionMesh | None) -> RegionMatch:
        """planned: None where the given region itself was planned on."""
        own = target.indices(region)
        if planned is None:
            return RegionMatch(np.ones(len(own), bool))
        near = planned.mesh.nearest(target.skin.points, target.skin.normals)
        facing = np.einsum("na,na->n", near.normals, target.skin.normals)
        on = (near.distances < _ON_M) & (facing > _ALIKE)
        given = np.zeros(len(on), bool)
        given[own] = True
        mesh = TargetMesh.from_mesh(Mesh(target.vertices, target.faces))
        middle = mesh.vertices[mesh.faces].mean(axis=1)
        truth = RegionMesh.from_faces(mesh, target.regions[region][target.nearest_faces(middle)])
        ratio = planned.mesh.border_length / max(truth.mesh.border_length, 1e-9)
        iou = float((on & given).sum() / max(int((on | given).sum()), 1))
        return RegionMatch(on[own], ratio if truth.mesh.border_length > 0.0 else None, iou)
