"""The surface and regions that are planned on: the mesh itself, votes on it, or a scan of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np

from nrdf.field.cloud_encoder import WORKING_POINTS
from nrdf.geometry.mesh import Mesh
from nrdf.geometry.normals import estimate_normals
from nrdf.geometry.sampling import downsample
from nrdf.io.cloud import PointCloud
from nrdf.scans.simulate import ScanSettings, simulate_scan
from nrdf.surface.object_mesh import object_mesh
from nrdf.surface.region_mesh import RegionMesh, region_mesh
from nrdf.surface.target_mesh import TargetMesh
from nrdf_benchmark.mesh_paths.targets import MeshTarget

SurfaceKind = Literal["mesh", "votes", "scan"]
SCAN = ScanSettings(views=3, pixels=800, noise=0.001)
SCAN_POINTS = 200_000


def regions_on(target: MeshTarget, kind: SurfaceKind) -> Callable[[str], RegionMesh]:
    """From a region's name to the faces that are planned on.

    mesh: the faces of the target that the region has. votes: the true labels of as many points as
    retrieval works on. scan: the same of the points of a simulated scan, on the mesh made of it.
    """
    if kind == "mesh":
        mesh = TargetMesh.from_mesh(Mesh(target.vertices, target.faces))
        face = target.nearest_faces(mesh.vertices[mesh.faces].mean(axis=1))
        return lambda name: RegionMesh.from_faces(mesh, target.regions[name][face])
    if kind == "votes":
        mesh = TargetMesh.from_mesh(Mesh(target.vertices, target.faces))
        points, normals, face = target.skin.points, target.skin.normals, target.skin.face
    else:
        points, normals, face = scan_of(target)
        mesh = object_mesh(PointCloud(points, normals, "m"), target.strategy.tool_radius_m)
    kept = downsample(points, WORKING_POINTS, np.random.default_rng(0))
    radius = target.strategy.tool_radius_m

    def by_votes(name: str) -> RegionMesh:
        membership = target.regions[name][face[kept]].astype(float)
        return region_mesh(mesh, points[kept], normals[kept], membership, radius)

    return by_votes


def scan_of(target: MeshTarget) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (n, 3), m, of a simulated scan, their estimated normals (n, 3), the faces (n,) hit."""
    rng = np.random.default_rng(0)
    scan = simulate_scan(target.vertices, target.faces, SCAN, rng)
    kept = rng.permutation(len(scan.face))[:SCAN_POINTS]
    points = scan.cloud.points[kept]
    return points, estimate_normals(points, sensors=scan.cloud.sensors), scan.face[kept]
