"""The surface in small cells, whose film or depth is computed: a region, and what lies around."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nrdf.surface.fine_mesh import FineMesh, refine
from nrdf.surface.mesh_patches import Patches
from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.target_mesh import TargetMesh

_PARALLEL = 0.9  # cosine


@dataclass(frozen=True)
class Cells:
    """Triangles of a surface, small to the tool.

    centres: (n, 3), m; normals: (n, 3), outward; areas_m2: (n,). inside: (n,), which are of the
    region; they come first, in the order of `fine`, the region's own mesh, refined. patches: of
    `fine`, where each cell is one.
    """

    centres: np.ndarray
    normals: np.ndarray
    areas_m2: np.ndarray
    inside: np.ndarray
    fine: FineMesh
    patches: Patches | None = None

    @staticmethod
    def rough(region: RegionMesh, size_m: float) -> Cells:
        """Patches of that size of a region alone, for a first look."""
        mesh = region.mesh
        own = FineMesh(mesh.vertices, mesh.faces, np.arange(len(mesh.faces)), size_m)
        patches = Patches.of(own, size_m)
        nearest = patches.nearest
        centres, normals, _ = region.on_parent(own.centres[nearest], own.normals[nearest])
        areas = np.bincount(patches.number, own.areas)
        return Cells(centres, normals, areas, np.ones(len(areas), bool), own, patches)

    @staticmethod
    def of(region: RegionMesh, edge_m: float, around_m: float) -> Cells:
        """Cells with edges of at most `edge_m`, of a region and of the object's other faces within
        `around_m` of it.

        Where the region was cut from another mesh of the object than its parent, its cells lie on
        the parent: behind it they would be in its shadow.
        """
        own = refine(region.mesh.vertices, region.mesh.faces, edge_m)
        centres, normals, same = region.on_parent(own.centres, own.normals)
        parts = [(centres, normals, own.areas, True)]
        beside = _beside(region, edge_m, around_m, same)
        if beside is not None:
            parts.append((*beside, False))
        return Cells(
            np.concatenate([part[0] for part in parts]),
            np.concatenate([part[1] for part in parts]),
            np.concatenate([part[2] for part in parts]),
            np.concatenate([np.full(len(part[2]), part[3]) for part in parts]),
            own,
        )

    def of_region(self, values: np.ndarray) -> np.ndarray:
        """Of values (n,), those of the region's triangles in `fine` (f,)."""
        own = values[self.inside]
        return own if self.patches is None else self.patches.to_triangles(own)


def _beside(
    region: RegionMesh, edge_m: float, around_m: float, same_m: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Centres, normals and areas of what lies around a region, farther from it than `same_m` or
    turned another way; None where nothing does."""
    parent = region.parent
    corners = parent.vertices[parent.faces]
    low, high = region.mesh.vertices.min(axis=0), region.mesh.vertices.max(axis=0)
    near = (corners.max(axis=1) > low - around_m).all(axis=1)
    near &= (corners.min(axis=1) < high + around_m).all(axis=1)
    if not near.any():
        return None
    part = parent.submesh(near)
    fine = refine(part.vertices, part.faces, edge_m)
    found = region.mesh.nearest(fine.centres, fine.normals)
    facing = np.einsum("na,na->n", found.normals, fine.normals)
    same = (found.distances < same_m) & (facing > _PARALLEL)
    kept = ~same & (found.distances < around_m)
    if not kept.any():
        return None
    return fine.centres[kept], fine.normals[kept], fine.areas[kept]


def plate(width_m: float, length_m: float, edge_m: float) -> TargetMesh:
    """A flat plate in the plane z = 0 around the origin, as `nrdf eval process` works it."""
    across = max(int(np.ceil(width_m / edge_m)), 1)
    along = max(int(np.ceil(length_m / edge_m)), 1)
    x, y = np.meshgrid(
        np.linspace(-0.5, 0.5, across + 1) * width_m,
        np.linspace(-0.5, 0.5, along + 1) * length_m,
        indexing="ij",
    )
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    number = np.arange(x.size).reshape(x.shape)
    a, b, c, d = (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:])
    faces = np.concatenate(
        [np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)]
    )
    return TargetMesh(vertices, faces)
