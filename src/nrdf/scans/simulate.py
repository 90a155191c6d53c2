"""Depth cameras simulated by ray casting, with known truth: for tests, demos and training."""

from __future__ import annotations

from dataclasses import dataclass

import igl
import numpy as np

from nrdf.errors import DataError
from nrdf.geometry.canonical import canonical_transform
from nrdf.geometry.mesh import check_mesh, triangle_crosses
from nrdf.geometry.similarity import Similarity
from nrdf.io.cloud import PointCloud

_FLOOR_SIZE = 1.5  # half the side of the floor that is seen, in longest sides of the object


@dataclass(frozen=True)
class ScanSettings:
    """How an object is looked at. Angles in rad; lengths named so in the mesh's unit.

    views: cameras, spread around the object's up axis, +Y. distance: from camera to the object's
    middle, in its longest sides. pixels: along each side of a square image that the object fills.
    noise: standard deviation of depth (length) at that distance; it grows with depth squared, as a
    stereo camera's does, and so does `quantisation`, the step of depth (length). grazing: angle
    between ray and surface below which returns begin to drop out; none is left at a fifth of it.
    floor: whether the object stands on one that is seen too.
    """

    views: int = 3
    distance: float = 2.0
    lowest: float = np.radians(10)
    highest: float = np.radians(40)
    pixels: int = 240
    noise: float = 0.0
    quantisation: float = 0.0
    grazing: float = np.radians(15)
    floor: bool = False


@dataclass(frozen=True)
class SimulatedScan:
    """What cameras saw, in the scan's frame and unit, and what is true of it.

    cloud: points (n, 3) and sensors; no normals. normals: (n, 3) true ones, towards the sensor.
    view: (n,) the sensor that saw each point. face: (n,) the triangle that was hit, -1 for the
    floor; second, third: (n,) barycentric weights of its second and third corner.
    pose: from the mesh's coordinates to the scan's.
    """

    cloud: PointCloud
    normals: np.ndarray
    view: np.ndarray
    face: np.ndarray
    second: np.ndarray
    third: np.ndarray
    pose: Similarity


def simulate_scan(
    vertices: np.ndarray,
    faces: np.ndarray,
    settings: ScanSettings,
    rng: np.random.Generator,
    pose: Similarity | None = None,
    unit: str | None = None,
) -> SimulatedScan:
    """Look at a mesh, vertices (v, 3) with +Y up and faces (f, 3), with depth cameras.

    One camera's azimuth is random and the others follow at equal steps, each up to a sixth of a
    step off; elevations are random. What the cameras see is then moved by `pose` (the identity
    unless given). Raises DataError for settings that make no sense, or cameras that see nothing.
    """
    _check(settings)
    vertices, faces = check_mesh(vertices, faces)
    middle, size = canonical_transform(vertices[np.unique(faces)])
    radius = float(np.linalg.norm(vertices - middle, axis=1).max())
    if settings.distance * size <= radius:
        raise DataError(
            f"cameras at {settings.distance:g} times the longest side stand within the object; "
            f"give a distance above {radius / size:.2f}"
        )
    tree = igl.AABB()
    tree.init(vertices, faces)
    ground = float(vertices[:, 1].min())
    step = 2 * np.pi / settings.views
    azimuth = rng.uniform(0, 2 * np.pi) + step * np.arange(settings.views)
    azimuth += step / 6 * rng.uniform(-1, 1, settings.views)
    elevation = rng.uniform(settings.lowest, settings.highest, settings.views)
    places, found = [], []
    for number, (a, e) in enumerate(zip(azimuth, elevation, strict=True)):
        toward = np.array([np.cos(e) * np.cos(a), np.sin(e), np.cos(e) * np.sin(a)])
        place = middle + settings.distance * size * toward
        rays = _rays(toward, radius / (settings.distance * size), settings.pixels)
        face, depth, weights = _cast(tree, vertices, faces, place, rays)
        normals = triangle_crosses(vertices, faces[np.maximum(face, 0)])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
        if settings.floor:
            drop = np.where(rays[:, 1] < -1e-6, (ground - place[1]) / rays[:, 1], np.inf)
            spot = (place + drop[:, None] * rays - middle)[:, [0, 2]]
            hit = (drop < depth) & (np.abs(spot).max(axis=1) < _FLOOR_SIZE * size)
            face, depth = np.where(hit, -1, face), np.where(hit, drop, depth)
            normals[hit] = [0.0, 1.0, 0.0]
        facing = -(normals * rays).sum(axis=1)
        normals *= np.where(facing < 0, -1.0, 1.0)[:, None]
        graze = np.sin(settings.grazing)
        seen = np.isfinite(depth)
        seen &= np.abs(facing) > graze * (0.2 + 0.8 * rng.random(len(rays)))
        # Depth is measured along the camera's axis.
        along = -rays[seen] @ toward
        far = depth[seen] * along
        grows = (far / (settings.distance * size)) ** 2
        far = far + settings.noise * grows * rng.normal(size=len(far))
        if settings.quantisation > 0:
            steps = settings.quantisation * grows
            far = np.round(far / steps) * steps
        places.append(place)
        found.append(
            (
                place + (far / along)[:, None] * rays[seen],
                normals[seen],
                np.full(len(far), number),
                face[seen],
                *weights[seen].T,
            )
        )
    points, normals, view, face, second, third = (
        np.concatenate(parts) for parts in zip(*found, strict=True)
    )
    if not (face >= 0).any():
        raise DataError("the cameras see nothing of the mesh; give more pixels or less grazing")
    pose = pose or Similarity(np.eye(3), np.zeros(3), 1.0)
    cloud = PointCloud(pose.to_scan(points), unit=unit, sensors=pose.to_scan(np.array(places)))
    return SimulatedScan(cloud, normals @ pose.rotation.T, view, face, second, third, pose)


def _check(settings: ScanSettings) -> None:
    wrong = [
        f"{name} {getattr(settings, name):g} must be {least:g} or more"
        for name, least in (("views", 1), ("pixels", 2), ("noise", 0), ("quantisation", 0))
        if not getattr(settings, name) >= least
    ]
    if not 0 <= settings.grazing < np.pi / 2:
        wrong.append(f"grazing {np.degrees(settings.grazing):g}° must be 0 to 90°")
    if wrong:
        raise DataError("cannot simulate this scan: " + "; ".join(wrong))


def _rays(toward: np.ndarray, sine: float, pixels: int) -> np.ndarray:
    """Unit directions (pixels², 3) of a camera that looks against `toward` at a ball which it sees
    under an angle of this `sine` from its middle to its edge."""
    right = np.cross([0.0, 1.0, 0.0], toward)
    right /= np.linalg.norm(right)
    reach = sine / np.sqrt(1 - sine**2)
    grid = reach * ((np.arange(pixels) + 0.5) * 2 / pixels - 1)
    x, y = np.meshgrid(grid, grid)
    rays = x.reshape(-1, 1) * right + y.reshape(-1, 1) * np.cross(toward, right) - toward
    return rays / np.linalg.norm(rays, axis=1, keepdims=True)


def _cast(
    tree: igl.AABB, vertices: np.ndarray, faces: np.ndarray, place: np.ndarray, rays: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The triangle that each ray hits first (n,), -1 for none; its distance (n,), infinite for
    none; barycentric weights (n, 2)."""
    origin = np.asfortranarray(np.broadcast_to(place, rays.shape))
    face, depth, weights = tree.intersect_ray_first(
        vertices, faces, origin, np.asfortranarray(rays)
    )
    missed = np.asarray(face) < 0
    return (
        np.asarray(face),
        np.where(missed, np.inf, depth),
        np.where(missed[:, None], 0.0, weights),
    )
