"""A region as users give it (mask, indices or points), brought to one form: indices."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from nrdf.errors import RegionError
from nrdf.io.cloud import PointCloud
from nrdf.io.file_names import file_name_problem
from nrdf.regions.sparse_points import points_between

ON_REFERENCE = 0.02
"""Largest distance of a region's point from the reference, as a share of its longest side."""
REGION_NAME = re.compile(r"\w[\w .+-]*")
"""What a region may be called: its name becomes a file name."""
LONGEST_NAME = 100
_FORMS = "a region is a boolean mask (n,), integer indices (m,) or points (m, 3) on the reference"


def region_name_fault(name: str) -> str:
    """Why `name` can be no region's, whose name becomes a file name; "" where it can."""
    if not REGION_NAME.fullmatch(name):
        return (
            "it begins with a letter or digit, and may have letters, digits, spaces and any of "
            ". + - _, because it becomes a file name"
        )
    if len(name) > LONGEST_NAME:
        return f"it has {len(name)} characters, and at most {LONGEST_NAME} are allowed"
    return file_name_problem(name)


def region_indices(
    region: ArrayLike | PointCloud,
    reference: PointCloud,
    tree: Callable[[], cKDTree] | None = None,
) -> np.ndarray:
    """Indices (m,) into `reference.points` of a region, in the region's own order.

    region: a boolean mask (n,), integer indices (m,), or points (m, 3) in the reference's frame
    and unit (array or PointCloud), each of which stands for the nearest reference point.
    tree: gives the tree of the reference's points where one is kept; called only if needed.

    Raises RegionError for a region that is empty, has the wrong shape, indices out of range,
    coordinates that are not finite, or points farther from the reference than 2 % of its longest
    side.
    """
    try:
        values = region.points if isinstance(region, PointCloud) else np.asarray(region)
    except ValueError as error:  # rows of different lengths
        raise RegionError(f"the region is no array: {error}; {_FORMS}") from None
    count = len(reference.points)
    if values.size == 0:
        raise RegionError("the region is empty; it needs at least one point of the reference")
    if values.dtype == bool:
        if values.shape != (count,):
            raise RegionError(
                f"a region's mask must have one value for each of the reference's {count} points, "
                f"not shape {values.shape}"
            )
        indices = np.flatnonzero(values)
        if len(indices) == 0:
            raise RegionError("the region's mask is False everywhere; mark at least one point")
        return indices
    if np.issubdtype(values.dtype, np.integer) and values.ndim == 1:
        if values.min() < 0 or values.max() >= count:
            raise RegionError(
                f"a region's indices must lie in 0 to {count - 1}, "
                f"not {values.min()} to {values.max()}"
            )
        return values.astype(np.int64)
    if values.ndim == 2 and values.shape[1] == 3 and values.dtype.kind in "iuf":
        found = cKDTree(reference.points) if tree is None else tree()
        return _nearest_indices(values.astype(np.float64), found)
    raise RegionError(f"{_FORMS}, not an array of {values.dtype} of shape {values.shape}")


def whole_region(region: ArrayLike | PointCloud, reference: PointCloud) -> np.ndarray:
    """Ascending indices (k,) of a region as of `region_indices`, without gaps: where it is given by
    points that are sparser than the reference's own, those between them are in it too."""
    indices = region_indices(region, reference)
    points = region.points if isinstance(region, PointCloud) else np.asarray(region)
    if points.ndim == 2 and reference.normals is not None:
        between = points_between(points, indices, reference.points, reference.normals)
        indices = np.concatenate([indices, between])
    return np.unique(indices)


def _nearest_indices(points: np.ndarray, reference: cKDTree) -> np.ndarray:
    if not np.isfinite(points).all():
        raise RegionError("the region has coordinates that are not finite; remove those points")
    distance, indices = reference.query(points)
    extent = float((reference.maxes - reference.mins).max())
    worst = float(distance.max())
    if worst > ON_REFERENCE * extent:
        off = int((distance > ON_REFERENCE * extent).sum())
        raise RegionError(
            f"{off} of the region's {len(points)} points are not on the reference: the farthest is "
            f"{worst:.4g} away from it ({100 * worst / extent:.1f} % of its longest side, "
            f"{extent:.4g}); at most {100 * ON_REFERENCE:.0f} % is allowed. Are both in the same "
            "frame and unit?"
        )
    return indices
