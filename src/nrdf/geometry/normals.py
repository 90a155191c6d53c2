"""Outward normals of a cloud that has none, and features of points with normals."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from nrdf.errors import CloudError
from nrdf.geometry.canonical import canonical_transform
from nrdf.geometry.sampling import fibonacci_directions
from nrdf.geometry.visibility import (
    nearest_points,
    sensor_direction_sum,
    sensors_brought_near,
    typical_spacing,
    view_direction_sum,
)

_LEAF = 64  # points


def estimate_normals(
    points: np.ndarray,
    neighbours: int = 16,
    directions: int = 100,
    sensors: np.ndarray | None = None,
) -> np.ndarray:
    """Outward unit normals (n, 3) of a cloud `points` (n, 3), any unit.

    The line of each normal comes from a principal component analysis of `neighbours` nearest
    points; its sign from visibility in orthographic depth images taken from `directions` evenly
    spread viewpoints, which stand in for hidden-point removal (Katz et al., 2007). That is for full
    clouds: of a surface that is open behind, both sides are seen. Where `sensors` (s, 3) is given,
    in the points' frame and unit, the sign is that of the sensors which can have seen the point.

    The mean direction that a point is seen from keeps the two sides of a thin sheet apart in the
    neighbourhoods, and neighbours on one sheet vote on the sign together. Raises CloudError with
    fewer than 4 points.
    """
    if len(points) < 4:
        raise CloudError(f"normals need at least 4 points, this cloud has {len(points)}")
    middle, scale = points.mean(axis=0), canonical_transform(points)[1]
    points = ((points - middle) / scale).astype(np.float32)
    neighbours = min(neighbours, len(points))
    distance, index = nearest_points(points, neighbours)
    spacing = typical_spacing(points, distance)
    closeness = np.exp(-((distance / (distance[:, neighbours // 2, None] + 1e-12)) ** 2)) + 1e-6

    if sensors is None:
        toward = view_direction_sum(
            points, None, fibonacci_directions(directions * 3 // 5), spacing, 0.7
        )
    else:
        sensors = sensors_brought_near((np.asarray(sensors) - middle) / scale).astype(np.float32)
        toward = sensor_direction_sum(points, None, sensors, spacing)
    toward /= np.linalg.norm(toward, axis=1, keepdims=True) + 1e-6
    same_side = np.maximum(np.einsum("nka,na->nk", toward[index], toward), 0.01) ** 2
    normals = principal_normals(points, index, closeness * same_side)

    if sensors is None:
        toward = view_direction_sum(points, normals, fibonacci_directions(directions), spacing, 0.4)
        trust = np.linalg.norm(toward, axis=1)
        toward *= (np.minimum(trust / (0.2 * directions), 1.0) / (trust + 1e-6))[:, None]
    else:
        toward = sensor_direction_sum(points, normals, sensors, spacing)
    sign = np.einsum("na,na->n", toward, normals)
    sign = consensus(sign, points, normals, index, closeness, 0.25 * spacing)
    return np.where(sign < 0.0, -1.0, 1.0)[:, None] * normals.astype(np.float64)


def oriented_features(points: np.ndarray, normals: np.ndarray, weight: float) -> np.ndarray:
    """Positions and weighted normals side by side, (..., 6), for nearest neighbours in both.

    With weight 0 only the positions, (..., 3), which is faster.
    """
    return np.concatenate([points, weight * normals], axis=-1) if weight else points


def oriented_tree(points: np.ndarray, normals: np.ndarray, weight: float) -> cKDTree:
    """A tree of `oriented_features`."""
    return search_tree(oriented_features(points, normals, weight))


def search_tree(features: np.ndarray) -> cKDTree:
    """A tree of features (n, d). Its leaves are large and its boxes are not shrunk: in six
    dimensions searches then take a quarter less time, with the same results."""
    return cKDTree(features, _LEAF, compact_nodes=False, balanced_tree=False)


def principal_normals(points: np.ndarray, index: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Unit normals (n, 3), sign arbitrary, of neighbourhoods `index` with `weight` (n, k)."""
    weight = weight / weight.sum(axis=1, keepdims=True)
    offset = points[index]
    offset -= np.einsum("nk,nka->na", weight, offset)[:, None]
    scatter = (offset * weight[:, :, None]).transpose(0, 2, 1) @ offset
    return np.linalg.eigh(scatter)[1][:, :, 0]


def consensus(
    sign: np.ndarray,
    points: np.ndarray,
    normals: np.ndarray,
    index: np.ndarray,
    closeness: np.ndarray,
    thickness: float,
) -> np.ndarray:
    """Let the signs (n,) of points on one sheet, at most `thickness` apart, vote together."""
    offset = points[index] - points[:, None]
    agreement = np.einsum("nka,na->nk", normals[index], normals)
    apart = np.maximum(
        np.abs(np.einsum("nka,na->nk", offset, normals)),
        np.abs(np.einsum("nka,nka->nk", offset, normals[index])),
    )
    weight = closeness * np.exp(-((apart / thickness) ** 2)) * agreement * np.abs(agreement)
    weight[:, 0] = 0.0
    weight /= np.abs(weight).sum(axis=1, keepdims=True) + 0.2
    voted = sign
    for _ in range(3):
        voted = sign + np.einsum("nk,nk->n", weight, np.tanh(3.0 * voted)[index])
    return voted
