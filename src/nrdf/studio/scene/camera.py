"""A pinhole camera, and the points that a ray or a rectangle on the screen selects."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.path import Path
from scipy.spatial.transform import Rotation

_HIDDEN = 2.5
"""A point that far behind another one on the screen, in spacings, is hidden by it."""


@dataclass(frozen=True)
class Camera:
    """A pinhole camera.

    position: (3,); rotation: (3, 3) from the camera's axes (x right, y down, z forward) to the
    world's; fov_rad: vertical field of camera; aspect: width over height. Places on the screen are
    (0, 0) in its upper left corner to (1, 1) in its lower right one.
    """

    position: np.ndarray
    rotation: np.ndarray
    fov_rad: float
    aspect: float

    @staticmethod
    def of(
        position: np.ndarray, quaternion_wxyz: np.ndarray, fov_rad: float, aspect: float
    ) -> Camera:
        """The camera of a camera whose rotation is a quaternion, scalar first."""
        w, x, y, z = quaternion_wxyz
        rotation = Rotation.from_quat([x, y, z, w]).as_matrix()
        return Camera(np.asarray(position, np.float64), rotation, fov_rad, aspect)

    def project(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Places (n, 2) of points (n, 3) on the screen, and their depths (n,); depths of 0 or less
        are behind the camera, and their places mean nothing."""
        seen = (points - self.position) @ self.rotation
        half = np.tan(self.fov_rad / 2)
        depth = seen[:, 2]
        flat = seen[:, :2] / np.maximum(depth, 1e-9)[:, None]
        return 0.5 + 0.5 * flat / [half * self.aspect, half], depth

    def ray(self, screen: tuple[float, float]) -> np.ndarray:
        """Unit direction (3,) from the camera through a screen on the screen."""
        half = np.tan(self.fov_rad / 2)
        x, y = (2 * np.asarray(screen, np.float64) - 1) * [half * self.aspect, half]
        direction = self.rotation @ np.array([x, y, 1.0])
        return np.asarray(direction / np.linalg.norm(direction))


def first_hit(
    points: np.ndarray,
    normals: np.ndarray,
    origin: np.ndarray,
    direction: np.ndarray,
    spacing: float,
) -> tuple[int, float] | None:
    """The point of a surface that a ray meets first: its index, and the depth along the ray.

    points: (n, 3); normals: (n, 3) outward; only those that face the ray are met, by passing
    within `spacing` of them. None where the ray meets nothing.
    """
    offset = points - origin
    depth = offset @ direction
    away = np.linalg.norm(offset - depth[:, None] * direction, axis=1)
    met = np.flatnonzero((depth > 0) & (away < spacing) & (normals @ direction < 0.1))
    if not len(met):
        return None
    # Among those of the first sheet, the one nearest to the ray.
    first = met[depth[met] < depth[met].min() + 2 * spacing]
    best = int(first[np.argmin(away[first])])
    return best, float(depth[best])


def points_in_rectangle(
    camera: Camera,
    points: np.ndarray,
    normals: np.ndarray,
    corners: tuple[tuple[float, float], tuple[float, float]],
    spacing: float,
    through: bool = False,
) -> np.ndarray:
    """Which points (n,) lie in a rectangle on the screen, of those that are seen, or `through` all.

    A point is seen if it faces the camera and no other one lies before it.
    """
    screen, depth = camera.project(points)
    low, high = np.minimum(*corners), np.maximum(*corners)
    chosen = (depth > 0) & (screen >= low).all(axis=1) & (screen <= high).all(axis=1)
    return chosen if through else chosen & visible_points(camera, points, normals, spacing)


def points_in_outline(
    camera: Camera, points: np.ndarray, normals: np.ndarray, outline: np.ndarray, spacing: float
) -> np.ndarray:
    """Which points (n,) are seen within an outline (m, 2) on the screen, as a lasso draws it."""
    screen, depth = camera.project(points)
    inside = (depth > 0) & Path(outline).contains_points(screen)
    return inside & visible_points(camera, points, normals, spacing)


def visible_points(
    camera: Camera, points: np.ndarray, normals: np.ndarray, spacing: float
) -> np.ndarray:
    """Which points (n,) of a surface face the camera with no other one before them.

    A depth image whose cells are as wide as `spacing` at the nearest point's depth.
    """
    screen, depth = camera.project(points)
    facing = np.einsum("na,na->n", normals, camera.position - points) > 0
    ahead = depth > 0
    if not ahead.any():
        return ahead
    half = np.tan(camera.fov_rad / 2)
    cell = 1.5 * spacing / (2 * half * np.median(depth[ahead]))
    column, row = (
        np.floor(screen[:, 0] * camera.aspect / cell),
        np.floor(screen[:, 1] / cell),
    )
    key = np.where(ahead, column * 1_000_003 + row, np.inf)
    pixel = np.unique(key, return_inverse=True)[1]
    nearest = np.full(int(pixel.max()) + 1, np.inf)
    np.minimum.at(nearest, pixel, np.where(facing & ahead, depth, np.inf))
    return facing & ahead & (depth <= nearest[pixel] + _HIDDEN * spacing)
