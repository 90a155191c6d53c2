"""Frames, thinning and oriented normals of point sets.

"Canonical" coordinates put the centre of the bounding box at the origin and make its longest side
1: ``canonical = (original - centre) / scale``. Canonical lengths carry no unit.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from nrdf.errors import CloudError

_LARGEST_GRID = 1 << 25  # cells of a dense voxel grid, 128 MiB of indices
_CHUNK = 1 << 18  # points handled at a time
_BOTH_SIDES = 0.4  # directions that see a point from its far side, to those from its near side
# Share of points seen from both sides from which a cloud is open: whole chairs and aircraft have
# 0.06 at most, simulated scans of three views 0.29 or more.
_OPEN = 0.15
_LEAST_SPACING = 0.1  # between points, where one longest side has the square root of their number
_SMALLEST = 1e-30  # a length that single precision holds
_FAR, _TOUCHING = 1000.0, 1e-6  # from sensor to object, canonical, at most and at least


def bounding_box(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest corner, each (3,), of `points` (n, 3), in their unit."""
    if len(points) == 0:
        raise CloudError("an empty point set has no bounding box; give at least one point")
    return points.min(axis=0), points.max(axis=0)


def canonical_transform(points: np.ndarray) -> tuple[np.ndarray, float]:
    """Centre (3,) and scale of `points` (n, 3): ``canonical = (points - centre) / scale``.

    The centre is the middle of the bounding box and the scale its longest side, both in the unit
    of `points`. Raises CloudError if there is no point or all points coincide.
    """
    lowest, highest = bounding_box(points)
    scale = float((highest - lowest).max())
    if not np.isfinite(scale) or scale <= 0.0:
        raise CloudError(
            f"the longest side of the points' bounding box is {scale}; a finite length above 0 is "
            "needed: all points coincide, or their coordinates are not finite"
        )
    return (lowest + highest) / 2.0, scale


def fibonacci_directions(count: int) -> np.ndarray:
    """`count` unit vectors (count, 3) spread evenly over the sphere (Fibonacci lattice)."""
    index = np.arange(count) + 0.5
    z = 1.0 - 2.0 * index / count
    radius = np.sqrt(1.0 - z * z)
    angle = np.pi * (1.0 + 5.0**0.5) * index
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)


def thin(points: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """Indices (min(n, count),), ascending, of a subset that covers `points` (n, 3) evenly.

    One random point is kept in every cell of a voxel grid whose cell size is found by bisection,
    so that dense places give up more points than sparse ones. Ten million points take about two
    seconds. Points must be finite.
    """
    total = len(points)
    if total <= count:
        return np.arange(total)
    lowest, highest = bounding_box(points)
    side = float((highest - lowest).max())
    if side == 0.0:
        return np.sort(rng.choice(total, count, replace=False))
    kept: np.ndarray = np.arange(total)
    if total > 8 * count:
        # A first, fine grid makes the bisection independent of the number of points.
        fine = one_per_cell(points, lowest, side / min(6.0 * np.sqrt(count), 320.0))
        few = len(fine) < 2 * count
        kept = np.unique(rng.integers(0, total, 8 * count)) if few else fine
        if len(kept) > 64 * count:
            kept = kept[np.unique(rng.integers(0, len(kept), 64 * count))]
    kept = rng.permutation(kept)
    candidates = points[kept]
    small, large = 1e-4, 1.0
    best = np.empty(0, dtype=np.int64)
    for _ in range(24):
        cell = float(np.sqrt(small * large))
        chosen = one_per_cell(candidates, lowest, cell * side)
        if len(chosen) >= count:
            best, small = chosen, cell
            if len(chosen) <= 1.02 * count:
                break
        else:
            large = cell
    chosen = kept[best]
    if len(chosen) < count:  # many coincident points: fill up with whatever is left
        rest = np.setdiff1d(np.arange(total), chosen)
        chosen = np.concatenate([chosen, rng.choice(rest, count - len(chosen), replace=False)])
    return np.sort(rng.choice(chosen, count, replace=False))


def one_per_cell(points: np.ndarray, lowest: np.ndarray, cell: float) -> np.ndarray:
    """Index of one point in each occupied cell of a grid, in the order of the cells."""
    shape = ((points.max(axis=0) - lowest) / cell).astype(np.int64) + 1
    strides = np.array([shape[1] * shape[2], shape[2], 1], dtype=np.float64)
    dense = float(np.prod(shape.astype(float))) <= _LARGEST_GRID
    first = np.full(int(np.prod(shape)) if dense else 0, -1, dtype=np.int32)
    keys = np.empty(0 if dense else len(points), dtype=np.int64)
    for start in range(0, len(points), _CHUNK):
        chunk = points[start : start + _CHUNK]
        key = (np.floor((chunk - lowest) / cell) @ strides).astype(np.int64)
        if dense:
            first[key] = np.arange(start, start + len(chunk), dtype=np.int32)
        else:
            keys[start : start + len(chunk)] = key
    return first[first >= 0].astype(np.int64) if dense else np.unique(keys, return_index=True)[1]


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
    distance, index = _nearest(points, neighbours)
    spacing = _spacing(points, distance)
    closeness = np.exp(-((distance / (distance[:, neighbours // 2, None] + 1e-12)) ** 2)) + 1e-6

    if sensors is None:
        toward = _seen_from(points, None, fibonacci_directions(directions * 3 // 5), spacing, 0.7)
    else:
        sensors = _nearer((np.asarray(sensors) - middle) / scale).astype(np.float32)
        toward = _seen_by(points, None, sensors, spacing)
    toward /= np.linalg.norm(toward, axis=1, keepdims=True) + 1e-6
    same_side = np.maximum(np.einsum("nka,na->nk", toward[index], toward), 0.01) ** 2
    normals = _principal_normals(points, index, closeness * same_side)

    if sensors is None:
        toward = _seen_from(points, normals, fibonacci_directions(directions), spacing, 0.4)
        trust = np.linalg.norm(toward, axis=1)
        toward *= (np.minimum(trust / (0.2 * directions), 1.0) / (trust + 1e-6))[:, None]
    else:
        toward = _seen_by(points, normals, sensors, spacing)
    sign = np.einsum("na,na->n", toward, normals)
    sign = _consensus(sign, points, normals, index, closeness, 0.25 * spacing)
    return np.where(sign < 0.0, -1.0, 1.0)[:, None] * normals.astype(np.float64)


def visibility(
    points: np.ndarray, normals: np.ndarray, directions: int = 40
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """From which side, and from how many of `directions`, `points` (n, 3) of a surface are seen.

    Returns, each (n,): the sum over the directions that see a point of the cosine to its normal
    (`normals` (n, 3), any sign); the number of those in front of it; the number of those behind.
    Points inside a hull are seen by few or none.
    """
    points, normals = points.astype(np.float32), normals.astype(np.float32)
    spacing = _spacing(points, _nearest(points, min(9, len(points)))[0])
    vote = np.zeros(len(points))
    front, back = np.zeros((2, len(points)), dtype=np.int64)
    views = fibonacci_directions(directions)
    for view, seen in _depth_images(points, normals, views, spacing, 0.4):
        facing = normals @ view
        vote += seen * facing
        front += seen & (facing > 0.0)
        back += seen & (facing < 0.0)
    return vote, front, back


def seen_through(points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Which `points` (n, 3) are seen from both sides, (n,) bool: none of a closed surface.

    Of a surface with large holes that is most of what is not before something else, and which of
    its sides was seen cannot be told. `normals` (n, 3), any sign.
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
    spacing = _spacing(points, _nearest(points, min(9, len(points)))[0])
    images = _depth_images(points, normals, views, spacing, 0.4)
    return np.array([seen & (normals @ view > steepest) for view, seen in images])


def _nearest(points: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Distances and indices, each (n, count), of the nearest points, the point itself first."""
    distance, index = cKDTree(points).query(points, count)
    return distance.astype(np.float32), index


def _spacing(points: np.ndarray, distance: np.ndarray) -> float:
    """Typical distance between points: the side of the square that each has to itself.

    Not less than if all had a hundredth of the square of the longest side to themselves: where most
    points coincide, depth images would have more cells than memory holds.
    """
    column = min(8, distance.shape[1] - 1)
    typical = float(np.median(distance[:, column])) * float(np.sqrt(np.pi / (column + 1)))
    side = float(np.ptp(points, axis=0).max())
    return max(typical, _LEAST_SPACING * side / float(np.sqrt(len(points))), _SMALLEST)


def _principal_normals(points: np.ndarray, index: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Unit normals (n, 3), sign arbitrary, of neighbourhoods `index` with `weight` (n, k)."""
    weight = weight / weight.sum(axis=1, keepdims=True)
    offset = points[index]
    offset -= np.einsum("nk,nka->na", weight, offset)[:, None]
    scatter = (offset * weight[:, :, None]).transpose(0, 2, 1) @ offset
    return np.linalg.eigh(scatter)[1][:, :, 0]


def _consensus(
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


def _seen_from(
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


def _nearer(sensors: np.ndarray) -> np.ndarray:
    """Sensors (s, 3) around the origin, those very far off brought nearer in their direction: at
    a thousand longest sides they see the same, and single precision tells points apart."""
    distance = np.linalg.norm(sensors, axis=1, keepdims=True)
    return sensors * (_FAR / np.maximum(distance, _FAR))


def _seen_by(
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
        _, pixel = np.unique(np.floor(np.stack([x, y], 1)), axis=0, return_inverse=True)
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
