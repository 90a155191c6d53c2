"""Heat maps of a result on its region: blue where there is too little, red where too much."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from nrdf.geometry.canonical import canonical_transform
from nrdf.geometry.frames import unit_vectors
from nrdf.geometry.mesh import Mesh, triangle_areas, triangle_crosses
from nrdf.viz.mesh_render import MeshScene, Triangles
from nrdf.viz.palette import NO_REGION
from nrdf.viz.view import Camera

LEVELS = (-np.inf, -3.0, -2.0, -1.0, -0.5, 0.5, 1.0, 2.0, 3.0, np.inf)
"""Ends of the colours' ranges, in tolerances off the target."""
COLOURS = (
    "#2b3a8f", "#3f6fb5", "#7db3d8", "#c6e3c0", "#e9f3d2", "#f5edb8", "#f3a65a", "#d9532c",
    "#8f1d22",
)  # fmt: skip
"""Of the ranges, from far too little to far too much; those in the middle are within tolerance."""
_AROUND = 1.15  # of the region, what the picture shows


@dataclass(frozen=True)
class HeatMap:
    """A picture (h, w, 3) in [0, 1], and the share of the area in each of the colours' ranges."""

    image: np.ndarray
    shares: tuple[float, ...]


def levels_of(values_m: np.ndarray, target_m: float, tolerance_m: float) -> np.ndarray:
    """The range (n,), an index into `COLOURS`, of each value."""
    return np.searchsorted(LEVELS[1:-1], (np.asarray(values_m) - target_m) / tolerance_m)


def level_areas(
    region: Triangles, values_m: np.ndarray, target_m: float, tolerance_m: float
) -> tuple[float, ...]:
    """The share of a region's area in each of the colours' ranges, by its faces' values (f,)."""
    level = levels_of(values_m, target_m, tolerance_m)
    areas = triangle_areas(np.asarray(region.vertices), np.asarray(region.faces))
    shares = np.bincount(level, areas, len(COLOURS)) / areas.sum()
    return tuple(shares.tolist())


def heat_map(
    whole: Triangles,
    region: Triangles,
    values_m: np.ndarray,
    target_m: float,
    tolerance_m: float,
    turn: np.ndarray | None = None,
    size: int = 420,
) -> HeatMap:
    """A region of an object, each of its faces (f,) in the colour of its value.

    turn: (3, 3), from columns of canonical directions to the object's frame, as a pose's rotation.
    size: of the picture's longer side, in pixels.
    """
    turn = np.eye(3) if turn is None else turn
    level = levels_of(values_m, target_m, tolerance_m)
    crosses = triangle_crosses(np.asarray(region.vertices), np.asarray(region.faces))
    shares = level_areas(region, values_m, target_m, tolerance_m)
    centre, scale = canonical_transform(np.asarray(whole.vertices) @ turn)

    def moved(mesh: Triangles, faces: np.ndarray) -> Mesh:
        return Mesh((np.asarray(mesh.vertices) @ turn - centre) / scale, faces)

    faces = np.asarray(region.faces)
    parts = [(k, moved(region, faces[level == k])) for k in np.unique(level)]
    scene = MeshScene.of(moved(whole, np.asarray(whole.faces)), parts, {})
    scene = replace(scene, borders=np.zeros((0, 2, 3)))
    normal = unit_vectors((crosses @ turn).sum(axis=0)[None])[0]
    axes = Camera.towards(normal).axes()
    seen = moved(region, faces).vertices[np.unique(faces)] @ axes.T
    low, high = seen.min(axis=0)[:2], seen.max(axis=0)[:2]
    wide = _AROUND * (high - low) + 1e-3
    pixels = size / float(wide.max())
    shape = (max(int(wide[1] * pixels), 8), max(int(wide[0] * pixels), 8))
    table = np.array([*(_rgb(colour) for colour in COLOURS), NO_REGION])
    corner = 0.5 * (low + high - wide)
    image = scene.render(axes, corner, pixels, shape, table, table[:-1])
    return HeatMap(np.asarray(image[::-1]), shares)


def _rgb(colour: str) -> list[float]:
    return [int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]
