"""Lines of even spacing along a surface: rasters."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import ndimage

from nrdf.geometry.polylines import total_length
from nrdf.surface.grid import Grid
from nrdf.surface.patch import Patch
from nrdf.toolpath.surface_path import PlanarPath


def raster(
    patch: Patch, angle: float, stepover_m: float, margin_m: float
) -> list[list[PlanarPath]]:
    """Lines across a patch, at `angle` (rad) in its plane, even along the surface.

    One list for each connected part of the patch inside its margin, in snake order; lines are
    broken where the surface is. A part is cut into even strips no wider than `stepover_m`, and each
    has its line in the middle.
    """
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    uv = patch.uv @ turn.T
    grid = Grid.around(uv, 0.5 * patch.spacing, 2.0 * patch.spacing)

    def clearance(places: np.ndarray) -> np.ndarray:
        return patch.border.clearance(places @ turn, margin_m)

    free = clearance(grid.nodes) > 0.0
    rows = np.flatnonzero(free.any(axis=1))
    if not len(rows):
        return []
    metric = turn @ patch.metric @ turn.T
    components = np.stack([metric[:, 0, 0], metric[:, 0, 1], metric[:, 1, 1]], axis=1)
    uu, mixed, vv = grid.smooth(uv, components, 1.5 * patch.spacing)
    across = distance_from_row(uu, mixed, vv, grid.pitch, int(rows.mean()))
    parts, count = ndimage.label(free, np.ones((3, 3)))
    blocks = [_part(grid, across, parts == k, clearance, stepover_m) for k in range(1, count + 1)]
    # Shorter than what the border is known to, a line is worth no approach of its own.
    return [[path @ turn for path in _long(block, patch.spacing)] for block in blocks if block]


def _long(paths: list[PlanarPath], least: float) -> list[PlanarPath]:
    """Paths no shorter than `least`; the longest, if there are none."""
    length = [total_length(s) for s in paths]
    least = min(least, max(length))
    return [path for path, way in zip(paths, length, strict=True) if way >= least]


def strip_middles(width: float, stepover: float) -> np.ndarray:
    """Middles (n,) of the fewest even strips, no wider than a stepover, that make up a width."""
    count = max(int(np.ceil(width / stepover - 0.02)), 1)
    return width * (np.arange(count) + 0.5) / count


def distance_from_row(
    uu: np.ndarray, uv: np.ndarray, vv: np.ndarray, pitch: float, row: int
) -> np.ndarray:
    """Signed distance along the surface of a grid's nodes from one of its rows.

    uu, uv, vv: components of the metric tensor, (rows, columns). The distance d has a gradient of
    length 1 everywhere (the eikonal equation); solved for its derivative by v, it is marched from
    row to row, as the lines of equal distance run along the rows.
    """
    det = uu * vv - uv * uv
    inverse_uv, inverse_vv = -uv / det, uu / det
    distance = np.zeros_like(uu)
    for sign, stop in ((1, len(uu)), (-1, -1)):
        d = np.zeros(uu.shape[1])
        for r in range(row + sign, stop, sign):
            a, b, c = inverse_uv[r - sign], inverse_vv[r - sign], det[r - sign]
            slope = np.gradient(d, pitch)
            by_v = (-a * slope + np.sqrt(np.maximum(b - slope**2 / c, 0.05 * b))) / b
            d = d + sign * pitch * by_v
            # A little viscosity keeps the central differences stable.
            d[1:-1] += 0.1 * (d[2:] - 2.0 * d[1:-1] + d[:-2])
            distance[r] = d
    return distance


def _part(
    grid: Grid,
    across: np.ndarray,
    inside: np.ndarray,
    clearance: Callable[[np.ndarray], np.ndarray],
    stepover: float,
) -> list[PlanarPath]:
    """Paths of the part of a grid that is `inside`; across: distance square to the lines."""
    low, high = across[inside].min(), across[inside].max()
    levels = low + strip_middles(high - low, stepover)
    near = ndimage.binary_dilation(inside, np.ones((3, 3)))
    columns = np.flatnonzero(near.any(axis=0))
    u = grid.origin[0] + grid.pitch * columns
    v_nodes = grid.origin[1] + grid.pitch * np.arange(grid.shape[0])
    v = np.stack([np.interp(levels, across[:, k], v_nodes) for k in columns], axis=1)
    lines = np.stack([np.broadcast_to(u, v.shape), v], axis=-1)
    near_line = grid.sample(near.astype(float), lines) > 0.0
    free = np.where(near_line, clearance(lines), -grid.pitch)
    paths: list[PlanarPath] = []
    for number in range(len(levels)):
        row = _stretches(lines[number], free[number])
        paths += row if number % 2 == 0 else [stretch[::-1] for stretch in row[::-1]]
    return paths


def _stretches(line: np.ndarray, free: np.ndarray) -> list[np.ndarray]:
    """The pieces of a line (m, 2) on which `free` (m,) is above 0, cut where it passes through."""
    good = np.concatenate([[False], free > 0.0, [False]])
    change = np.flatnonzero(good[1:] != good[:-1])
    pieces = []
    for first, last in zip(change[::2], change[1::2], strict=True):
        piece = [line[first:last]]
        if first > 0:
            share = free[first] / (free[first] - free[first - 1])
            piece.insert(0, line[first : first + 1] + share * (line[first - 1] - line[first]))
        if last < len(line):
            share = free[last - 1] / (free[last - 1] - free[last])
            piece.append(line[last - 1 : last] + share * (line[last] - line[last - 1]))
        pieces.append(np.concatenate(piece))
    return pieces
