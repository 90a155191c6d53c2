"""The floor or table that an object stands on, found as a plane that carries everything else."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nrdf.geometry.canonical import bounding_box
from nrdf.geometry.mesh import triangle_crosses
from nrdf.geometry.sampling import downsample

_SAMPLE = 3000  # points that hypotheses are tested on
_HYPOTHESES = 400
_THICKNESS = 0.005  # of the cloud's longest side: points so near to a plane are on it, at first
_BELOW = 0.02  # share of points that may lie under a floor
_TILT = np.cos(np.radians(15))  # a floor is level up to this
_SMALLEST = 0.03  # share of points that a floor has
_DIRECTIONS = 16
_AROUND = 0.8  # of the directions, in which a floor reaches further than what stands on it


@dataclass(frozen=True)
class Plane:
    """Points p with normal @ p = offset; normal (3,) unit, up; thickness: of what lies on it."""

    normal: np.ndarray
    offset: float
    thickness: float

    def height(self, points: np.ndarray) -> np.ndarray:
        """Height (n,) of points (n, 3) above the plane."""
        return points @ self.normal - self.offset


def find_floor(points: np.ndarray, up: np.ndarray | None, rng: np.random.Generator) -> Plane | None:
    """The plane under all of `points` (n, 3), if there is one that holds many of them (RANSAC).

    up: (3,) unit, or None to take planes of any direction. A plane is a floor if next to nothing
    lies under it and it reaches further than what stands on it in most directions: the flat
    underside of a sofa or a wing does not.
    """
    sample = points[downsample(points, _SAMPLE, rng)]
    low, high = bounding_box(sample)
    thickness = _THICKNESS * float((high - low).max())
    drawn = rng.integers(0, len(sample), (_HYPOTHESES, 3))
    normals = triangle_crosses(sample, drawn)
    length = np.linalg.norm(normals, axis=1)
    good = length > thickness**2
    normals, corners = normals[good] / length[good, None], sample[drawn[good, 0]]
    if up is not None:
        normals *= np.where(normals @ up < 0, -1.0, 1.0)[:, None]
        level = normals @ up > _TILT
        normals, corners = normals[level], corners[level]
    if not len(normals):
        return None
    heights = normals @ sample.T - np.einsum("ha,ha->h", normals, corners)[:, None]
    on = (np.abs(heights) < thickness).mean(axis=1)
    below = (heights < -2 * thickness).mean(axis=1)
    if up is None:  # whichever side is empty is below
        above = (heights > 2 * thickness).mean(axis=1)
        normals = np.where((above < below)[:, None], -normals, normals)
        below = np.minimum(above, below)
    on[(below > _BELOW) | (on < _SMALLEST)] = 0.0
    best = int(on.argmax())
    if on[best] == 0.0:
        return None
    plane = _refined(sample, Plane(normals[best], float(normals[best] @ corners[best]), thickness))
    return plane if _carries_the_rest(sample, plane) else None


def _refined(sample: np.ndarray, plane: Plane) -> Plane:
    """Least squares through the points on a plane, which then tell how thick it is."""
    for _ in range(3):
        near = sample[np.abs(plane.height(sample)) < plane.thickness]
        if len(near) < 3:
            return plane
        middle = near.mean(axis=0)
        normal = np.linalg.svd(near - middle, full_matrices=False)[2][2]
        normal = normal if normal @ plane.normal > 0 else -normal
        plane = Plane(normal, float(normal @ middle), plane.thickness)
    spread = float(np.median(np.abs(plane.height(near)))) / 0.6745
    thickness = min(max(4 * spread, plane.thickness / 3), 2 * plane.thickness)
    return Plane(plane.normal, plane.offset, thickness)


def _carries_the_rest(sample: np.ndarray, plane: Plane) -> bool:
    height = plane.height(sample)
    floor, rest = sample[np.abs(height) < plane.thickness], sample[height > 2 * plane.thickness]
    if len(rest) < 0.01 * len(sample):
        return True
    first = np.linalg.svd(plane.normal[None])[2][1]
    angle = 2 * np.pi / _DIRECTIONS * np.arange(_DIRECTIONS)
    ways = np.outer(np.cos(angle), first) + np.outer(np.sin(angle), np.cross(plane.normal, first))
    reach, needed = (ways @ floor.T).max(axis=1), (ways @ rest.T).max(axis=1)
    margin = 0.03 * float((needed + np.roll(needed, _DIRECTIONS // 2)).max())
    return bool((reach > needed + margin).mean() >= _AROUND)
