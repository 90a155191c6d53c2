"""Lines of even spacing along a surface: rasters."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from nrdf.process.grid import Grid
from nrdf.process.patch import Patch

Stroke = np.ndarray
"""(m, 2): places in a patch's plane that a tool passes without lifting."""


def raster(patch: Patch, angle: float, stepover_m: float, margin_m: float) -> list[list[Stroke]]:
    """Lines across a patch, at `angle` (rad) in its plane, even along the surface.

    One list for each connected part of the patch inside its margin, in snake order; lines are
    broken where the surface is. A part is cut into even strips no wider than `stepover_m`, and each
    has its line in the middle.
    """
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    uv = patch.uv @ turn.T
    grid = Grid.around(uv, 0.5 * patch.spacing, 2.0 * patch.spacing)
    nodes = grid.nodes
    clear = patch.border.clearance(nodes @ turn, margin_m)
    if not (clear > 0.0).any():
        return []
    metric = turn @ patch.metric @ turn.T
    uu, uv_, vv = (
        grid.smooth(uv, metric[:, i, j], 1.5 * patch.spacing) for i, j in ((0, 0), (0, 1), (1, 1))
    )
    rows = np.flatnonzero((clear > 0.0).any(axis=1))
    across = distance_from_row(uu, uv_, vv, grid.pitch, int(rows.mean()))
    parts, count = ndimage.label(clear > 0.0, np.ones((3, 3)))
    strokes = []
    for part in range(1, count + 1):
        inside = parts == part
        found = _part(grid, across, inside, clear, patch, turn, stepover_m, margin_m)
        if found:
            strokes.append([stroke @ turn for stroke in found])
    return strokes


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
    clear: np.ndarray,
    patch: Patch,
    turn: np.ndarray,
    stepover: float,
    margin: float,
) -> list[Stroke]:
    low, high = across[inside].min(), across[inside].max()
    levels = low + strip_middles(high - low, stepover)
    near = ndimage.binary_dilation(inside, np.ones((3, 3)))
    columns = np.flatnonzero(near.any(axis=0))
    u = grid.origin[0] + grid.pitch * columns
    v_nodes = grid.origin[1] + grid.pitch * np.arange(grid.shape[0])
    v = np.stack([np.interp(levels, across[:, k], v_nodes) for k in columns], axis=1)
    lines = np.stack([np.broadcast_to(u, v.shape), v], axis=-1)
    free = patch.border.clearance(lines @ turn, margin)
    free = np.where(grid.sample(near.astype(float), lines) > 0.0, free, -grid.pitch)
    strokes: list[Stroke] = []
    for number in range(len(levels)):
        row = _stretches(lines[number], free[number])
        strokes += row if number % 2 == 0 else [stretch[::-1] for stretch in row[::-1]]
    return strokes


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
