"""A sparse cloud as a closed mesh: the solid whose gradient its normals are."""

from __future__ import annotations

import igl
import numpy as np
from scipy import fft
from scipy.ndimage import map_coordinates
from scipy.spatial import cKDTree

from nrdf.errors import ProcessError
from nrdf.geometry.frames import unit_vectors
from nrdf.geometry.mesh import triangle_areas
from nrdf.surface.scan_ends import trimmed
from nrdf.surface.scan_grid import CUBE_CORNERS
from nrdf.surface.scan_mesh import on_surface
from nrdf.surface.scan_points import smooth_points
from nrdf.surface.target_mesh import TargetMesh

_NEIGHBOURS, _ALIKE = 12, 0.3  # points around, and the cosine between normals of one side
_CELL, _BLUR = 0.55, 0.35  # of the grid and of the normals' spread, in spacings
_MARGIN = 4.0  # spacings around the object
_FARTHEST = 2.5  # spacings from the nearest point that a face may be
_SETTLED = 0.35  # spacings that a vertex is moved onto the points' planes, at most
_MOST_CELLS = 24_000_000


def poisson_mesh(points: np.ndarray, normals: np.ndarray) -> TargetMesh:
    """The closed surface of points (n, 3), m, with outward normals (n, 3), in small triangles.

    The indicator of the solid is the function whose gradient is nearest to the normals, spread
    over the space around their points: Poisson's equation, solved by fast Fourier transforms
    (Kazhdan, "Reconstruction of solid models from oriented point sets", 2005). Bad normals here
    and there do no harm, and there are no cracks; a sheet thinner than about a spacing vanishes.
    Where the points end, the surface does, too. Raises ProcessError where none is found.
    """
    normals = unit_vectors(normals)
    tree = cKDTree(points)
    away, near = tree.query(points, min(_NEIGHBOURS, len(points)))
    own = (np.einsum("nka,na->nk", normals[near], normals) > _ALIKE).sum(axis=1)
    area = np.pi * away[:, -1] ** 2 / np.maximum(own, 1)
    spacing = float(np.sqrt(np.median(area)))
    area = np.minimum(area, 4.0 * spacing**2)
    low = points.min(axis=0) - _MARGIN * spacing
    extent = points.max(axis=0) + _MARGIN * spacing - low
    cell = max(_CELL * spacing, float(np.prod(extent) / _MOST_CELLS) ** (1.0 / 3.0))
    inside = _indicator(points - low, area[:, None] * normals, extent, cell, _BLUR * spacing)
    inside -= np.median(map_coordinates(inside, (points - low).T / cell, order=1))
    vertices, faces = _zero_surface(inside, low, cell, tree, _FARTHEST * spacing)
    if not len(faces):
        raise ProcessError("no closed surface goes through the points")
    outward = unit_vectors(np.nan_to_num(igl.per_vertex_normals(vertices, faces)))
    scan = smooth_points(points, normals, _CELL * spacing)
    smooth = cKDTree(scan.points)
    limit = _SETTLED * spacing
    moves = on_surface(scan, smooth, vertices, outward)[0] - vertices
    way = np.linalg.norm(moves, axis=1, keepdims=True)
    vertices = vertices + moves * np.minimum(1.0, limit / np.maximum(way, 1e-12))
    past = tree.query(vertices)[0] / spacing
    size = triangle_areas(vertices, faces) / spacing**2
    faces = trimmed(faces, size > 1e-9, past, size)
    used, faces = np.unique(faces, return_inverse=True)
    return TargetMesh(vertices[used], faces.reshape(-1, 3))


def _indicator(
    places: np.ndarray, flux: np.ndarray, extent: np.ndarray, cell: float, blur: float
) -> np.ndarray:
    """On a grid (a, b, c) of edge `cell`, the function that rises against the flux (n, 3) through
    surface at places (n, 3)."""
    shape = tuple(fft.next_fast_len(int(np.ceil(side / cell)) + 2, real=True) for side in extent)
    first = np.floor(places / cell).astype(np.int64)
    part = places / cell - first
    waves = [2.0 * np.pi * fft.fftfreq(count, cell) for count in shape[:2]]
    waves.append(2.0 * np.pi * fft.rfftfreq(shape[2], cell))
    along = np.ix_(*[wave.astype(np.float32) for wave in waves])
    total = np.zeros((shape[0], shape[1], shape[2] // 2 + 1), np.complex64)
    corners = [(first + corner).T for corner in CUBE_CORNERS]
    weights = [np.prod(np.abs(1.0 - corner - part), axis=1) for corner in CUBE_CORNERS]
    for axis in range(3):
        spread = np.zeros(shape, np.float32)
        for corner, weight in zip(corners, weights, strict=True):
            np.add.at(spread, tuple(corner), weight * flux[:, axis])
        total += 1j * along[axis] * fft.rfftn(spread, workers=2)
    square = along[0] ** 2 + along[1] ** 2 + along[2] ** 2
    square[0, 0, 0] = 1.0
    total *= np.exp(-0.5 * blur**2 * square) / square
    total[0, 0, 0] = 0.0
    return np.asarray(fft.irfftn(total, s=shape, workers=2))


def _zero_surface(
    inside: np.ndarray, low: np.ndarray, cell: float, tree: cKDTree, farthest: float
) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (v, 3) and outward faces (f, 3) where a grid is 0, near the points."""
    shape = inside.shape
    within = inside > 0.0
    count = np.zeros(tuple(side - 1 for side in shape), np.int8)
    for corner in CUBE_CORNERS:
        count += within[
            tuple(slice(a, a + side - 1) for a, side in zip(corner, shape, strict=True))
        ]
    cells = np.argwhere((count > 0) & (count < 8))
    reach = farthest + cell
    away = tree.query(low + cell * (cells + 0.5), distance_upper_bound=reach)[0]
    cells = cells[away < reach]
    if not len(cells):
        return np.zeros((0, 3)), np.zeros((0, 3), np.int64)
    index = np.ravel_multi_index(tuple((cells[:, None] + CUBE_CORNERS).reshape(-1, 3).T), shape)
    used, number = np.unique(index, return_inverse=True)
    places = low + cell * np.stack(np.unravel_index(used, shape), axis=1)
    values = -inside.reshape(-1)[used].astype(np.float64)
    cubes = np.ascontiguousarray(number.reshape(-1, 8))
    vertices, faces = igl.marching_cubes(values, places, cubes, 0.0)[:2]
    vertices, faces = np.asarray(vertices), np.asarray(faces, np.int64)
    real = triangle_areas(vertices, faces) > 5e-10 * cell**2
    faces = faces[real & (tree.query(vertices[faces].mean(axis=1))[0] < farthest)]
    used, faces = np.unique(faces, return_inverse=True)
    return vertices[used], faces.reshape(-1, 3)
