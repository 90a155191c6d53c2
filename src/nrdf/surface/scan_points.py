"""The points of a scan, thinned and moved onto the smooth surface between them."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from nrdf.errors import ProcessError
from nrdf.geometry.frames import tangent_frames, unit_vectors
from nrdf.geometry.quadrics import quadric_normals, quadrics

_MOST_POINTS = 300_000  # of a thinned scan: more only cost time and memory
_THINNED, _FINEST = 0.6, 0.75  # of an edge: cells that points are thinned to; edges of a spacing
_FITTED, _LEAST = 24, 6  # points that a quadric is fitted to
_ALIKE, _AGAINST = 0.3, -0.3  # cosines between normals of one side, and of two
_LEVEL = 0.08  # of the reach: points no farther from a tangent plane lie in it
_TURNED, _TURNED_BY = 4, 3  # points in the plane that look back: at least, and for each other one
_THICK = 1.4  # cells that a sheet, or a slot, must be thick for marching cubes to see it
_OPPOSITE = -0.5  # cosine between the normals of a sheet's two sides
_EVENED = 12  # neighbours that the offset is averaged over
_STEEP, _MOST_STEEP = 0.9, 0.4  # slope of a fit that its normal does not belong to, and their share
_ROUGH = 0.09  # of the reach: typical distance of points to their fit, where there is no surface
_WIDER = (1.0, 2.0, 4.0)
_AT_ONCE = 1 << 13
_THREADS = min(2, os.cpu_count() or 1)


@dataclass(frozen=True, eq=False)
class ScanPoints:
    """Points (n, 3), m, on the smooth surface, unit normals (n, 3) of it, outward.

    spacing: (n,), m, distance between points around each. offset: (n,), m, how far outward the
    surface is moved while it is looked for, and then back, so that both sides of a thin sheet are
    found (or inward, beside a narrow slot). cell: edge of the grid that fits, m.
    """

    points: np.ndarray
    normals: np.ndarray
    spacing: np.ndarray
    offset: np.ndarray
    cell: float


def for_parts(work: Callable[[slice], None], count: int) -> None:
    """Calls `work` with slices of `count` rows, in two threads where there are two processors."""
    parts = [slice(start, start + _AT_ONCE) for start in range(0, count, _AT_ONCE)]
    with ThreadPoolExecutor(_THREADS) as threads:
        list(threads.map(work, parts))


def smooth_points(points: np.ndarray, normals: np.ndarray, edge_m: float) -> ScanPoints:
    """The points (n, 3), m, of a scan with unit normals (n, 3), made ready for a mesh with edges of
    about `edge_m`.

    Points are averaged in cells, those of each side apart. A normal against nearly all others in
    its plane is turned. Each point is then moved onto a quadric through those around of its side.
    Raises ProcessError where the normals do not belong to the points, or no surface goes through
    them.
    """
    for wider in _WIDER:  # where noise is larger than the cells, the mean of more points
        thin = _thinned(points, normals, wider * _THINNED * edge_m)
        near, away, turned = _neighbours(thin[0], thin[1])
        moved, outward, spacing, steep, rough = _fitted(thin[0], turned, thin[2], near, away)
        if np.median(rough) <= _ROUGH:
            break
    else:
        raise ProcessError(
            "no surface goes through the points of the scan: they are scattered; remove what is "
            "not of the object (nrdf align does), or scan it with less noise"
        )
    if (share := float((steep > _STEEP).mean())) > _MOST_STEEP:
        raise ProcessError(
            f"the normals do not belong to the points: {100 * share:.0f} % of them lie along the "
            "surface; leave them out, so that they are estimated"
        )
    spacing = np.minimum(spacing, 4.0 * np.median(spacing))
    cell = max(edge_m, _FINEST * float(np.median(spacing)))
    offset = _offset(moved, outward, spacing, near, cell)
    return ScanPoints(moved, outward, spacing, offset, cell)


def _thinned(
    points: np.ndarray, normals: np.ndarray, cell: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The mean of the points of each cell and side, with its normal, and their number (n,)."""
    axis = np.abs(normals).argmax(axis=1)
    side = 2 * axis + (normals[np.arange(len(normals)), axis] > 0.0)
    low, size = points.min(axis=0), float(np.ptp(points, axis=0).max())
    while True:
        cell = max(cell, size / (1 << 19))
        place = np.floor((points - low) / cell).astype(np.int64)
        key = place @ np.array([1 << 43, 1 << 23, 1 << 3]) + side
        _, number, count = np.unique(key, return_inverse=True, return_counts=True)
        if len(count) <= _MOST_POINTS:
            break
        cell *= 1.05 * np.sqrt(len(count) / _MOST_POINTS)
    number = number.reshape(-1)
    mean = [np.bincount(number, points[:, a]) / count for a in range(3)]
    total = [np.bincount(number, normals[:, a]) for a in range(3)]
    return np.stack(mean, axis=1), unit_vectors(np.stack(total, axis=1)), count


def _neighbours(
    points: np.ndarray, normals: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The nearest points (n, k) of each, their distances (n, k), and normals (n, 3) of which those
    that look the wrong way are turned."""
    tree = cKDTree(points, balanced_tree=False, compact_nodes=False)
    count = min(_FITTED, len(points))
    near = np.empty((len(points), count), np.int32)
    away = np.empty((len(points), count), np.float32)
    wrong = np.zeros(len(points), bool)

    def work(part: slice) -> None:
        away[part], near[part] = tree.query(points[part], count)
        around = near[part]
        facing = _along(normals[around], normals[part])
        rise = _along(points[around] - points[part][:, None], normals[part])
        level = np.abs(rise) < _LEVEL * away[part][:, -1:]
        agree = (level & (facing > _ALIKE)).sum(axis=1) - 1
        against = (level & (facing < _AGAINST)).sum(axis=1)
        wrong[part] = (against >= _TURNED) & (against > _TURNED_BY * agree)

    for_parts(work, len(points))
    return near, away, np.where(wrong[:, None], -normals, normals)


def _fitted(
    points: np.ndarray, normals: np.ndarray, count: np.ndarray, near: np.ndarray, away: np.ndarray
) -> tuple[np.ndarray, ...]:
    """Points moved onto the quadric through those around of their side, its normals there; the
    distance between points around each; the quadric's slope against the normals that were given,
    and the mean distance of points to it, as a share of its reach; all of (n,)."""
    moved, turned = points.copy(), normals.copy()
    spacing, steep, rough = np.empty((3, len(points)))
    single, weights = normals.astype(np.float32), count.astype(np.float32)

    def work(part: slice) -> None:
        around, reach = near[part], 1.02 * away[part][:, -1:] + np.float32(1e-12)
        facing = _along(single[around], single[part])
        fading = (1.0 - (away[part] / reach) ** 2) ** 2
        weight = np.maximum(facing - np.float32(_ALIKE), 0.0) * fading * weights[around]
        outward = unit_vectors((weight[:, None] @ single[around])[:, 0])
        frame = tangent_frames(outward)
        offset = (points[around] - points[part][:, None]).astype(np.float32) / reach[..., None]
        offset = offset @ frame.astype(np.float32).transpose(0, 2, 1)
        found = quadrics(offset[..., :2], offset[..., 2:], weight)[:, :, 0]
        enough = ((weight > 0.0).sum(axis=1) >= _LEAST)[:, None]
        rest = offset[..., 2] - found[:, :1] - (offset[..., :2] @ found[:, 1:3, None])[..., 0]
        height = np.where(enough, np.clip(found[:, :1], -0.5, 0.5) * reach, 0.0)
        found[:, 1:3] = np.where(enough, np.clip(found[:, 1:3], -1.0, 1.0), 0.0)
        moved[part] += height * outward
        turned[part] = np.einsum("na,nab->nb", quadric_normals(found), frame)
        same = np.maximum((facing > _ALIKE).sum(axis=1), 1)
        spacing[part] = away[part][:, -1] * np.sqrt(np.pi / same)
        steep[part] = np.abs(found[:, 1:3]).max(axis=1)
        total = np.maximum(weight.sum(axis=1), 1e-12)
        rough[part] = np.where(enough[:, 0], (weight * np.abs(rest)).sum(axis=1) / total, 1.0)

    for_parts(work, len(points))
    return moved, turned, spacing, steep, rough


def _offset(
    points: np.ndarray, normals: np.ndarray, spacing: np.ndarray, near: np.ndarray, cell: float
) -> np.ndarray:
    """How far outward (n,), m, the surface is moved: half of what a sheet is too thin by; or
    inward, negative, beside a slot that is too narrow."""
    least = _THICK * cell
    points, normals = points - points.mean(axis=0), normals.astype(np.float32)
    points = points.astype(np.float32)
    found, even = np.zeros(len(points), np.float32), np.zeros(len(points))

    def work(part: slice) -> None:
        around = near[part]
        offset = points[around] - points[part][:, None]
        rise = _along(offset, normals[part])
        aside = np.sqrt(np.maximum((offset * offset).sum(axis=2) - rise * rise, 0.0))
        other = _along(normals[around], normals[part]) < _OPPOSITE
        other &= aside < np.maximum(least, 1.5 * spacing[part][:, None])
        behind = other & (rise < 0.1 * cell) & (rise > -least)
        before = other & (rise >= 0.1 * cell) & (rise < least)
        thickness = -(rise * behind).sum(axis=1) / np.maximum(behind.sum(axis=1), 1)
        width = (rise * before).sum(axis=1) / np.maximum(before.sum(axis=1), 1)
        grown = np.clip(least - np.maximum(thickness, 0.0), 0.0, least) / 2.0
        shrunk = np.clip(width - least, -least, 0.0) / 2.0
        found[part] = np.where(behind.any(axis=1), grown, np.where(before.any(axis=1), shrunk, 0.0))

    def average(part: slice) -> None:
        around = near[part, :_EVENED]
        weight = np.maximum(_along(normals[around], normals[part]), 0.0)
        even[part] = (weight * found[around]).sum(axis=1) / np.maximum(weight.sum(axis=1), 1e-9)

    for_parts(work, len(points))
    for_parts(average, len(points))
    return even


def _along(vectors: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Lengths (n, k) of vectors (n, k, 3) along directions (n, 3)."""
    return np.asarray((vectors @ directions[:, :, None])[..., 0])
