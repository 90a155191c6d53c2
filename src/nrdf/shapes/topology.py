"""Exact correspondences of meshes that share their triangulation: vertex i is vertex i.

Template-fitted and morphable shapes come so. Any folder of meshes is looked through; those with
the same list of faces get a correspondence group `shared-<number>` of the same points of the same
triangles.
"""

from __future__ import annotations

import hashlib
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from nrdf.shapes.dataset import Correspondence, read_shape, read_stamp, write_shape

POINTS = 4096
ON_SKIN = 0.02
"""Canonical distance from the prepared surface beyond which a place is not on the outside."""


def add_shared_topology(meshes: Iterable[Path], folder: Path) -> dict[str, list[str]]:
    """Give prepared shapes in `folder` the groups of their meshes (named alike, `<name>.npz`).

    A place of a mesh that is not on its prepared outer surface has weight 0. Returns the names of
    the shapes of each group.
    """
    loaded: dict[str, list[tuple[str, trimesh.Trimesh]]] = defaultdict(list)
    for path in sorted(meshes):
        mesh = trimesh.load(path, process=False, force="mesh")
        assert isinstance(mesh, trimesh.Trimesh)  # what force="mesh" means
        content = f"{len(mesh.vertices)} ".encode() + np.asarray(mesh.faces, np.int64).tobytes()
        loaded[hashlib.sha256(content).hexdigest()].append((path.stem, mesh))
    groups = {}
    for number, key in enumerate(sorted(key for key, found in loaded.items() if len(found) > 1)):
        name = f"shared-{number:02d}"
        first = loaded[key][0][1]
        rng = np.random.default_rng(0)
        face = rng.choice(len(first.faces), POINTS, p=_mean_areas(loaded[key]))
        corner = rng.dirichlet(np.ones(3), POINTS)
        for stem, mesh in loaded[key]:
            path = folder / f"{stem}.npz"
            if path.is_file():
                _add(path, name, mesh, face, corner)
        groups[name] = [stem for stem, _ in loaded[key]]
    return groups


def _mean_areas(found: list[tuple[str, trimesh.Trimesh]]) -> np.ndarray:
    """Share of each face of the surface, averaged over the meshes (faces,)."""
    area = sum(mesh.area_faces / mesh.area for _, mesh in found)
    return area / area.sum()


def _add(
    path: Path, name: str, mesh: trimesh.Trimesh, face: np.ndarray, corner: np.ndarray
) -> None:
    shape = read_shape(path)
    if name in shape.correspondences:
        return
    triangles = (mesh.triangles[face] - shape.loc) / shape.scale
    points = np.einsum("nk,nkd->nd", corner, triangles)
    normals = np.array(mesh.face_normals[face])
    distance, nearest = cKDTree(shape.surface_points).query(points)
    # The mesh may be inside out; the prepared surface is not.
    if np.mean((normals * shape.surface_normals[nearest]).sum(1)) < 0:
        normals = -normals
    group = Correspondence(points, normals, (distance < ON_SKIN).astype(np.float32))
    write_shape(
        path,
        replace(shape, correspondences={**shape.correspondences, name: group}),
        read_stamp(path) or "",
    )
