"""Regions given by points that are not the reference's own, and sparser than those."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from nrdf.geometry.frames import tangent_frames

_OWN = 1e-6  # of the reference's longest side: nearer points are the reference's own
_SPARSER = 1.3  # times the reference's spacing
_FAR = 4.0  # spacings of the region
_AROUND = 8  # points of the region that a point must lie between
_GAP = np.radians(240)  # widest angle without any of them
_FACING = 0.5  # least cosine between normals of one side


def points_between(
    points: np.ndarray, indices: np.ndarray, reference: np.ndarray, normals: np.ndarray
) -> np.ndarray:
    """Indices (k,) of reference points that lie between those of a region, others than `indices`.

    points: (m, 3) of the region; indices: (m,) of the reference points nearest to them; reference,
    normals: (n, 3). Empty where the region's points are the reference's own, or as dense: then
    each stands for one. A mesh that was sampled once for the region and again as the reference
    would have its region in specks otherwise. Thin parts keep their sides apart.
    """
    none = np.zeros(0, np.int64)
    if len(points) <= _AROUND:
        return none
    away = np.linalg.norm(points - reference[indices], axis=1)
    if away.max() <= _OWN * np.ptp(reference, axis=0).max():
        return none
    tree = cKDTree(points)
    spacing = float(np.median(tree.query(points, 2)[0][:, 1]))
    near = cKDTree(reference).query(reference[indices], 2)[0][:, 1]
    if spacing <= _SPARSER * float(np.median(near)):
        return none
    other = np.setdiff1d(np.arange(len(reference)), indices)
    distance, around = tree.query(reference[other], np.arange(1, _AROUND + 1))
    close = distance[:, 0] <= _FAR * spacing
    other, distance, around = other[close], distance[close], around[close]
    facing = np.einsum("ija,ia->ij", normals[indices][around], normals[other]) > _FACING
    counts = facing & (distance <= _FAR * spacing)
    away_to = points[around] - reference[other][:, None]
    along = np.einsum("ija,iba->bij", away_to, tangent_frames(normals[other])[:, :2])
    angles = np.sort(np.where(counts, np.arctan2(along[1], along[0]), np.inf), axis=1)
    count = counts.sum(axis=1)
    first, last = angles[:, 0], angles[np.arange(len(other)), np.maximum(count - 1, 0)]
    enough = count >= 3
    other, angles, first, last = other[enough], angles[enough], first[enough], last[enough]
    angles = np.minimum(angles, last[:, None])  # those that do not count leave no gap
    widest = np.maximum(np.diff(angles, axis=1).max(axis=1), first + 2 * np.pi - last)
    return np.asarray(other[widest < _GAP])
