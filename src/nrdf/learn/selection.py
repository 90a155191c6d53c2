"""Which of a kind's objects are learned from, and which are kept to judge by."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from nrdf.shapes.dataset import Shape

ALIKE = 0.004
"""Mean distance between two surfaces, in longest sides, below which they are one object."""
_HELD_OUT = 0.2  # of the objects
_MOST_HELD_OUT = 6
_POINTS = 1024  # of each shape whose distance is taken
_SIZES = 0.02  # canonical: boxes that differ by more are not of one object


def find_duplicates(shapes: Sequence[Shape]) -> dict[str, str]:
    """Names of shapes that are nearly the same as an earlier one, and that one's name.

    The shapes are in one frame. Points are compared with the planes of the others' nearest ones, so
    that sampling does not count.
    """
    sizes = [np.ptp(shape.surface_points, axis=0) for shape in shapes]
    trees = [cKDTree(shape.surface_points) for shape in shapes]
    found: dict[str, str] = {}
    for later in range(len(shapes)):
        for earlier in range(later):
            if shapes[earlier].name in found:
                continue
            if np.abs(sizes[later] - sizes[earlier]).max() > _SIZES:
                continue
            pairs = (shapes[later], shapes[earlier]), (shapes[earlier], shapes[later])
            index = earlier, later
            if all(_apart(*pair, trees[n]) < ALIKE for pair, n in zip(pairs, index, strict=True)):
                found[shapes[later].name] = shapes[earlier].name
                break
    return found


def hold_out(names: Sequence[str]) -> tuple[str, ...]:
    """The names, always the same of the same ones, to judge by: one in five, 1 to 6."""
    count = min(max(1, round(_HELD_OUT * len(names))), _MOST_HELD_OUT)
    order = np.random.default_rng(0).permutation(len(names))
    return tuple(sorted(sorted(names)[n] for n in order[:count]))


def _apart(one: Shape, other: Shape, tree: cKDTree) -> float:
    """Mean distance of some points of one shape from the tangent planes of another."""
    chosen = np.random.default_rng(0).permutation(len(one.surface_points))[:_POINTS]
    points = one.surface_points[chosen]
    near, index = tree.query(points)
    along = np.abs(((points - other.surface_points[index]) * other.surface_normals[index]).sum(1))
    # Beyond the other's surface the plane says nothing: there the distance itself counts.
    return float(np.where(near > 5 * ALIKE, near, along).mean())
