"""Marching cubes in those cells only that the surface between the points of a scan goes through."""

from __future__ import annotations

import igl
import numpy as np
from scipy.spatial import cKDTree

from nrdf.surface.scan_points import ScanPoints, for_parts

GAP = 2.2
"""Spacings from the nearest point, along the surface, that the surface is followed to."""
_NEAREST = 8  # points that the distance at a place comes from
_AGAINST = 0.3  # cosine between normals from which points are of the other side
_ROUNDS = 8  # of cells added beside those that the surface goes through
_CODE = np.array([1 << 42, 1 << 21, 1])
CUBE_CORNERS = np.array(
    [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
)
_SIDES = (
    ((-1, 0, 0), (0, 3, 7, 4)), ((1, 0, 0), (1, 2, 6, 5)), ((0, -1, 0), (0, 1, 5, 4)),
    ((0, 1, 0), (3, 2, 6, 7)), ((0, 0, -1), (0, 1, 2, 3)), ((0, 0, 1), (4, 5, 6, 7)),
)  # fmt: skip
"""The step to each neighbour of a cell, and the corners that they share."""


def zero_surface(scan: ScanPoints, tree: cKDTree) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (v, 3) and faces (f, 3), outward, where the signed distance to the scan's surface is
    its offset.

    tree: of the scan's points. It begins in the cells with points, and goes on to each neighbour
    that the surface leads to, across gaps between points and up to `GAP` spacings past the ends.
    """
    # An odd fraction: flat sides then miss the corners of cells.
    origin = scan.points.min(axis=0) - (_ROUNDS + 4.371) * scan.cell
    shifted = scan.points + scan.offset[:, None] * scan.normals
    new = _once(np.floor((shifted - origin) / scan.cell).astype(np.int64) @ _CODE)
    cells, corners = np.zeros((2, 0), np.int64)
    distance, far = np.zeros(0), np.zeros(0, bool)
    for _ in range(_ROUNDS):
        asked = _without(_once(new + (CUBE_CORNERS @ _CODE)[:, None]), corners)
        found = _distances(scan, tree, _places(asked, origin, scan.cell))
        cells, corners = np.sort(np.concatenate([cells, new])), np.concatenate([corners, asked])
        order = np.argsort(corners, kind="stable")
        corners = corners[order]
        distance = np.concatenate([distance, found[0]])[order]
        far = np.concatenate([far, found[1]])[order]
        index = np.searchsorted(corners, new[:, None] + CUBE_CORNERS @ _CODE)
        outside, beyond = distance[index] > 0.0, far[index]
        beside = []
        for step, shared in _SIDES:
            crossed = outside[:, shared].any(axis=1) & ~outside[:, shared].all(axis=1)
            crossed &= ~beyond[:, shared].any(axis=1)
            beside.append(new[crossed] + np.array(step) @ _CODE)
        new = _without(_once(np.concatenate(beside)), cells)
        if not len(new):
            break
    index = np.searchsorted(corners, cells[:, None] + CUBE_CORNERS @ _CODE)
    outside = distance[index] > 0.0
    crossed = outside.any(axis=1) & ~outside.all(axis=1) & ~far[index].any(axis=1)
    if not crossed.any():
        return np.zeros((0, 3)), np.zeros((0, 3), np.int64)
    places = _places(corners, origin, scan.cell)
    chosen = np.ascontiguousarray(index[crossed])
    vertices, faces = igl.marching_cubes(distance, places, chosen, 0.0)[:2]
    return np.asarray(vertices), np.asarray(faces, np.int64)


def _once(codes: np.ndarray) -> np.ndarray:
    """Codes of any shape, ascending, each once."""
    # np.unique makes a hash table, which is a hundred times slower here.
    codes = np.sort(codes.reshape(-1))
    return codes[np.concatenate([[True], codes[1:] != codes[:-1]])] if len(codes) else codes


def _without(codes: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Those of ascending codes that are not among ascending known ones."""
    if not len(known):
        return codes
    place = np.minimum(np.searchsorted(known, codes), len(known) - 1)
    return codes[known[place] != codes]


def _places(codes: np.ndarray, origin: np.ndarray, cell: float) -> np.ndarray:
    mask = (1 << 21) - 1
    return origin + cell * np.stack([codes >> 42, (codes >> 21) & mask, codes & mask], axis=1)


def _distances(
    scan: ScanPoints, tree: cKDTree, places: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Signed distances (m,), m, of places (m, 3) to the surface moved by its offset, and whether
    (m,) no point is near."""
    count = min(_NEAREST, len(scan.points))
    least = np.maximum(scan.spacing, 0.75 * scan.cell)
    gap = GAP * np.maximum(scan.spacing, 0.8 * scan.cell)
    distance, far = np.empty(len(places)), np.empty(len(places), bool)

    def work(part: slice) -> None:
        away, near = tree.query(places[part], count)
        points, normals = scan.points[near], scan.normals[near]
        weight = np.exp(-((away / (least[near[:, :1]] + 0.5 * away[:, :1])) ** 2)) + 1e-30
        facing = (normals @ normals[:, 0, :, None])[..., 0]
        height = ((places[part][:, None] - points) * normals).sum(axis=2) - scan.offset[near]
        own = weight * np.maximum(facing, 0.0)
        found = (own * height).sum(axis=1) / own.sum(axis=1)
        # Between two sides: inside a sheet is inside of both, in a slot outside of both.
        other = weight * np.maximum(-facing - _AGAINST, 0.0)
        row = np.flatnonzero(other.any(axis=1))
        if len(row):
            other = other[row]
            across = (other * height[row]).sum(axis=1) / other.sum(axis=1)
            rise = ((points[row] - points[row, :1]) * normals[row, :1]).sum(axis=2)
            sheet = (other * rise).sum(axis=1) < 0.0
            found[row] = np.where(
                sheet, np.maximum(found[row], across), np.minimum(found[row], across)
            )
        distance[part] = found
        along = away[:, 0] ** 2 - (found + scan.offset[near[:, 0]]) ** 2
        far[part] = along > gap[near[:, 0]] ** 2

    for_parts(work, len(places))
    return distance, far
