"""Which points of a surface are seen, from which directions and by which sensors.

Depth images stand in for hidden-point removal (Katz et al., 2007).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from nrdf.geometry.sampling import fibonacci_directions

_BOTH_SIDES = 0.4  # directions that see a point from its far side, to those from its near side
# Share of points seen from both sides from which a cloud is open: whole chairs and aircraft have
# 0.06 at most, simulated scans of three views 0.29 or more.
_OPEN = 0.15
_LEAST_SPACING = 0.1  # between points, where one longest side has the square root of their number
_SMALLEST = 1e-30  # a length that single precision holds
_WIDEST = 1 << 28  # pixels from an image's middle
_FAR, _TOUCHING = 1000.0, 1e-6  # from sensor to object, canonical, at most and at least


def visibility(
    points: np.ndarray, normals: np.ndarray, directions: int = 40
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """From which side, and from how many of `directions`, `points` (n, 3) of a surface are seen.

    Returns, each (n,): the sum over the directions that see a point of the cosine to its normal
    (`normals` (n, 3), any sign); the number of those in front of it; the number of those behind.
    Points inside a hull are seen by few or none.
    """
    points, normals = points.astype(np.float32), normals.astype(np.float32)
    spacing = typical_spacing(points, nearest_points(points, min(9, len(points)))[0])
    vote = np.zeros(len(points))
    front, back = np.zeros((2, len(points)), dtype=np.int64)
    views = fibonacci_directions(directions)
    for view, seen in _depth_images(points, normals, views, spacing, 0.4):
        facing = normals @ view
        vote += seen * facing
        front += seen & (facing > 0.0)
        back += seen & (facing < 0.0)
    return vote, front, back


def seen_from_both_sides(points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Which `points` (n, 3) are seen from both sides, (n,) bool: none of a closed surface.

    On a surface with large holes these are most points, and nothing tells which of their sides a
    sensor saw. `normals` (n, 3), any sign.
    """
    _, front, back = visibility(points, normals)
    less, more = np.minimum(front, back), np.maximum(front, back)
    both = (less > 2) & (less > _BOTH_SIDES * more)
    return both if both.mean() > _OPEN else np.zeros(len(points), bool)


def seen_from(
    points: np.ndarray, normals: np.ndarray, views: np.ndarray, steepest: float = 0.17
) -> np.ndarray:
    """Which `points` (n, 3) of a surface are seen from each of the directions `views` (d, 3).

    Returns (d, n) bool. A point must face the view, the cosine to its outward normal (`normals`
    (n, 3)) being above `steepest`, and nothing may lie before it.
    """
    points, normals = points.astype(np.float32), normals.astype(np.float32)
    spacing = typical_spacing(points, nearest_points(points, min(9, len(points)))[0])
    images = _depth_images(points, normals, views, spacing, 0.4)
    return np.array([seen & (normals @ view > steepest) for view, seen in images])


def view_direction_sum(
    points: np.ndarray,
    normals: np.ndarray | None,
    views: np.ndarray,
    spacing: float,
    tolerance: float,
) -> np.ndarray:
    """Sum (n, 3) of the directions `views` (d, 3) that each point is seen from."""
    toward = np.zeros_like(points)
    for view, seen in _depth_images(points, normals, views, spacing, tolerance):
        toward += seen[:, None] * view
    return toward


def sensors_brought_near(sensors: np.ndarray) -> np.ndarray:
    """Sensors (s, 3) around the origin, those very far off brought nearer in their direction: at
    a thousand longest sides they see the same, and single precision tells points apart."""
    distance = np.linalg.norm(sensors, axis=1, keepdims=True)
    return sensors * (_FAR / np.maximum(distance, _FAR))


def sensor_direction_sum(
    points: np.ndarray, normals: np.ndarray | None, sensors: np.ndarray, spacing: float
) -> np.ndarray:
    """Sum (n, 3) of the unit vectors to those `sensors` (s, 3) that can see each point.

    Perspective depth images with cells of twice the point `spacing` at the points' middle. With
    `normals` (n, 3), any sign, a surface is allowed to be as deep in a cell as its slant makes it.
    A point behind all others in every image was measured all the same, so it gets a little of each
    sensor.
    """
    toward = np.zeros_like(points)
    for sensor in sensors:
        offset = sensor - points
        distance = np.maximum(np.linalg.norm(offset, axis=1), _TOUCHING)
        offset /= distance[:, None]
        axis = sensor / max(float(np.linalg.norm(sensor)), 1e-6)
        helper = np.eye(3, dtype=np.float32)[int(np.abs(axis).argmin())]
        right = np.cross(axis, helper)
        right /= np.linalg.norm(right)
        depth = np.maximum(offset @ axis, 1e-3)
        cell = 2.0 * spacing / max(float(np.median(distance)), 1e-3)
        x, y = (-(offset @ side) / depth / cell for side in (right, np.cross(axis, right)))
        column, row = (
            np.floor(np.clip(side, -_WIDEST, _WIDEST)).astype(np.int64) for side in (x, y)
        )
        # One number for each is sorted much faster than pairs.
        _, pixel = np.unique(column * (4 * _WIDEST) + row, return_inverse=True)
        nearest = np.full(int(pixel.max()) + 1, np.inf, dtype=np.float32)
        np.minimum.at(nearest, pixel.ravel(), distance)
        thickness = np.float32(2.0)
        if normals is not None:
            facing = np.abs(np.einsum("na,na->n", normals, offset))
            slant = np.sqrt(np.maximum(1.0 - facing**2, 0.0)) / np.maximum(facing, 0.2)
            thickness = 0.7 + 2.0 * slant
        seen = distance <= nearest[pixel.ravel()] + thickness * spacing
        toward += np.where(seen, 1.0, 0.01)[:, None] * offset
    return toward


def nearest_points(points: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Distances and indices, each (n, count), of the nearest points, the point itself first."""
    tree = cKDTree(points)
    # Asked in the tree's own order, neighbours find what they need in the processor's cache.
    order = tree.indices
    found, near = tree.query(points[order], np.arange(1, count + 1))
    distance = np.empty(found.shape, np.float32)
    index = np.empty_like(near)
    distance[order], index[order] = found, near
    return distance, index


def typical_spacing(points: np.ndarray, distance: np.ndarray) -> float:
    """Typical distance between points: the side of the square that each has to itself.

    Not less than if all had a hundredth of the square of the longest side to themselves: where most
    points coincide, depth images would have more cells than memory holds.
    """
    column = min(8, distance.shape[1] - 1)
    typical = float(np.median(distance[:, column])) * float(np.sqrt(np.pi / (column + 1)))
    side = float(np.ptp(points, axis=0).max())
    return max(typical, _LEAST_SPACING * side / float(np.sqrt(len(points))), _SMALLEST)


def _depth_images(
    points: np.ndarray,
    normals: np.ndarray | None,
    views: np.ndarray,
    spacing: float,
    tolerance: float,
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Each of `views` (d, 3) with the mask (n,) of the points that it sees.

    Orthographic depth images with cells of twice the point `spacing`; a point is seen if no other
    of its cell is nearer by `tolerance` spacings. With `normals` (n, 3), any sign, depths are
    compared on the points' tangent planes at the middle of the cell, so that a surface seen at a
    slant does not hide itself.
    """
    cell, steepest = 2.0 * spacing, 3.0
    views = views.astype(np.float32)
    helper = np.where(np.abs(views[:, :1]) < 0.7, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    right = np.cross(views, helper)
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    frames = np.stack([right / cell, np.cross(views, right) / cell, views], axis=1)
    turned = np.ascontiguousarray(points.T)
    lines = None if normals is None else np.ascontiguousarray(normals.T)
    for view, frame in zip(views, frames.astype(np.float32), strict=True):
        x, y, depth = frame @ turned
        x -= x.min()
        y -= y.min()
        column, row = x.astype(np.int64), y.astype(np.int64)
        if lines is not None:
            slope_x, slope_y, toward = frame @ lines
            steep = np.copysign(np.maximum(np.abs(toward), 1.0 / steepest), toward) / cell**2
            depth += ((x - column - 0.5) * slope_x + (y - row - 0.5) * slope_y) / steep
        pixel = row * (int(column.max()) + 1) + column
        nearest = np.full(int(pixel.max()) + 1, -np.inf, dtype=np.float32)
        np.maximum.at(nearest, pixel, depth)
        yield view, depth >= nearest[pixel] - np.float32(tolerance * spacing)
