"""Lines that follow a region's border: contour-parallel rings and spirals."""

from __future__ import annotations

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from nrdf.geometry.polylines import arc_length, even_arc_lengths, interpolate
from nrdf.surface.grid import Grid
from nrdf.surface.patch import Patch
from nrdf.toolpath.raster import strip_middles
from nrdf.toolpath.surface_path import PlanarPath

_ROUND = 0.4  # of the stepover: how far corners are rounded


def contour(patch: Patch, stepover_m: float, margin_m: float) -> list[list[PlanarPath]]:
    """Closed rings at even distances from a patch's border, from the outside in.

    One list for each connected part of the patch inside its margin. Each ring starts where the one
    before it ended, and all run the same way round.
    """
    parts = []
    for rings, _, _ in _rings(patch, stepover_m, margin_m):
        ordered: list[PlanarPath] = []
        end = rings[0][0][0]
        for level in rings:
            waiting = list(level)
            while waiting:
                nearest = int(np.argmin([np.linalg.norm(r - end, axis=1).min() for r in waiting]))
                ordered.append(_started_near(waiting.pop(nearest), end))
                end = ordered[-1][0]
        parts.append(ordered)
    return parts


def spiral(patch: Patch, stepover_m: float, margin_m: float) -> list[list[PlanarPath]]:
    """Spirals from a patch's border inwards, one path for each chain of nested rings.

    The first ring is followed whole, then each turn leads from one ring to the next inside it, and
    the innermost is followed whole. Where rings split, each branch has a spiral of its own.
    """
    parts = []
    for rings, grid, depth in _rings(patch, stepover_m, margin_m):
        slope = np.stack(np.gradient(depth, grid.pitch)[::-1], axis=-1)
        paths, end = [], rings[0][0][0]
        for chain in _chains(rings, stepover_m):
            # Turns that cannot sink any further on a ridge are straightened out.
            paths.append(_smooth(_wound(chain, grid, depth, slope, end), _ROUND * stepover_m))
            end = paths[-1][-1]
        parts.append(paths)
    return parts


def _rings(
    patch: Patch, stepover: float, margin: float
) -> list[tuple[list[list[PlanarPath]], Grid, np.ndarray]]:
    """For each part: rings by level from outside in, closed, anticlockwise; grid; depth on it."""
    grid = Grid.around(patch.uv, 0.5 * patch.spacing, 2.0 * patch.spacing)
    clear = patch.border.clearance(grid.nodes, margin)
    clear = np.maximum(clear, -grid.pitch)
    parts, count = ndimage.label(clear > 0.0, np.ones((3, 3)))
    found = []
    for part in range(1, count + 1):
        near = ndimage.binary_dilation(parts == part, np.ones((3, 3)), iterations=2)
        depth = ndimage.gaussian_filter(np.where(near, clear, -grid.pitch), 1.0)
        levels = strip_middles(float(depth.max()), stepover)
        rings = [
            [
                _smooth(_anticlockwise(ring), _ROUND * stepover)
                for ring in grid.contours(depth, level)
            ]
            for level in levels
        ]
        rings = [level for level in rings if level]
        if rings:
            found.append((rings, grid, depth))
    return found


def _anticlockwise(ring: PlanarPath) -> PlanarPath:
    x, y = ring.T
    area = np.sum(x[:-1] * y[1:] - x[1:] * y[:-1])
    return ring if area > 0.0 else ring[::-1]


def _smooth(line: PlanarPath, reach: float) -> PlanarPath:
    """A line with its corners, and what the ragged border has left in it, rounded; even steps."""
    length = arc_length(line)
    at = even_arc_lengths(float(length[-1]), 0.25 * reach, least=8)
    even, count = interpolate(at, length, line), len(at) - 1
    # Short rings would shrink to nothing.
    sigma = min(reach * count / length[-1], 0.05 * count)
    if np.array_equal(line[0], line[-1]):
        rounded = ndimage.gaussian_filter1d(even[:-1], sigma, axis=0, mode="wrap")
        return np.concatenate([rounded, rounded[:1]])
    return ndimage.gaussian_filter1d(even, sigma, axis=0, mode="nearest")


def _started_near(ring: PlanarPath, place: np.ndarray) -> PlanarPath:
    """A closed ring turned so that it begins, and ends, at its point nearest to `place` (2,)."""
    k = int(np.argmin(np.linalg.norm(ring[:-1] - place, axis=1)))
    turned = np.roll(ring[:-1], -k, axis=0)
    return np.concatenate([turned, turned[:1]])


def _chains(rings: list[list[PlanarPath]], stepover: float) -> list[list[PlanarPath]]:
    """Rings that lie one inside the other without a branch, each list from the outside in."""
    chains: list[list[PlanarPath]] = []
    ends: list[int] = []  # the chain that each ring of the level before is the end of
    before: list[PlanarPath] = []
    for level in rings:
        trees = [cKDTree(ring) for ring in before]
        parents = []
        for ring in level:
            away = [float(np.median(tree.query(ring)[0])) for tree in trees]
            parents.append(int(np.argmin(away)) if away and min(away) < 1.5 * stepover else -1)
        now = []
        for ring, parent in zip(level, parents, strict=True):
            if parent >= 0 and parents.count(parent) == 1:
                chains[ends[parent]].append(ring)
                now.append(ends[parent])
            else:
                now.append(len(chains))
                chains.append([ring])
        ends, before = now, level
    return chains


def _wound(
    chain: list[PlanarPath],
    grid: Grid,
    depth: np.ndarray,
    slope: np.ndarray,
    end: np.ndarray,
) -> PlanarPath:
    """One path along a chain of rings, each turn sinking by a stepover."""
    ring = _started_near(chain[0], end)
    pieces = [ring]
    for inner in chain[1:]:
        walked = arc_length(ring)
        here, there = (float(grid.sample(depth, r).mean()) for r in (ring, inner))
        wanted = here + (there - here) * walked / walked[-1]
        turn, farthest = ring, 2.0 * abs(there - here)
        for _ in range(4):
            by = np.stack([grid.sample(slope[..., a], turn) for a in (0, 1)], axis=-1)
            steep = np.maximum((by**2).sum(axis=1), 0.25)
            missing = wanted - grid.sample(depth, turn)
            move = turn + by * (missing / steep)[:, None] - ring
            # Where the depth has a ridge there is no way down on the other side.
            length = np.linalg.norm(move, axis=1, keepdims=True)
            turn = ring + move * np.minimum(1.0, farthest / np.maximum(length, 1e-12))
        # On either side of a ridge the way down differs: the turn goes over it smoothly.
        turn = ring + ndimage.gaussian_filter1d(turn - ring, 3.0, axis=0, mode="nearest")
        pieces.append(turn[1:])
        # A little ahead, so that the way never turns back.
        ahead = turn[-1] - turn[-4]
        step = 0.5 * abs(there - here) / max(float(np.linalg.norm(ahead)), 1e-12)
        ring = _started_near(inner, turn[-1] + step * ahead)
    if len(chain) > 1:
        pieces.append(ring)
    return np.concatenate(pieces)
