"""Objects as users have them: a path, an array, a mesh or cloud of trimesh or Open3D, as a cloud.

Other libraries' objects are known by their attributes, so that none of them is imported.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from nrdf.errors import CloudError, DataError
from nrdf.geometry.mesh import check_coordinate_range, check_mesh, clean_mesh
from nrdf.geometry.units import parse_unit
from nrdf.io.cloud import PointCloud, drop_partial_normals, read_cloud
from nrdf.io.formats.meshes import sample_mesh
from nrdf.io.formats.raw import RawCloud

MESH_SAMPLES = 30_000
_ACCEPTED = (
    "accepted are a path, an array (n, 3) of points, a PointCloud, a mesh or cloud of trimesh, and "
    "a cloud or mesh of Open3D"
)


def as_cloud(given: Any, name: str = "the cloud", mesh_samples: int = MESH_SAMPLES) -> PointCloud:
    """An object as users have it, as a cloud.

    Points of arrays and clouds keep their order and number.

    Args:
        given: a PointCloud is taken as it is; a path (str or Path) as `read_cloud` reads it; an
            array, or what NumPy makes one of, as points (n, 3). Trimesh's Trimesh and Scene, and
            Open3D's TriangleMesh, are sampled as a mesh file is. Trimesh's and Open3D's
            PointCloud are taken as they are.
        name: what it is, for messages.
        mesh_samples: points that a mesh is sampled to.

    Raises:
        CloudError: a file or object cannot be used, or is anything else.
    """
    if isinstance(given, PointCloud):
        return given
    if isinstance(given, (str, os.PathLike)):
        return read_cloud(os.fspath(given), mesh_samples)
    if hasattr(given, "geometry") and hasattr(given, "to_mesh"):  # trimesh.Scene
        given = _whole(given, name)
    faces = getattr(given, "faces", getattr(given, "triangles", None))
    if hasattr(given, "vertices") and faces is not None:
        return _sampled(given, faces, name, mesh_samples)
    points = next((getattr(given, n) for n in ("points", "vertices") if hasattr(given, n)), given)
    cloud = PointCloud(_rows(points, name), _normals(given, name), unit=_unit(given))
    if len(cloud) == 0:
        raise CloudError(f"{name} holds no points")
    return drop_partial_normals(name, cloud)


def _whole(scene: Any, name: str) -> Any:
    """The meshes of trimesh's scene as one."""
    try:
        mesh = scene.to_mesh()
        mesh.units = scene.units
    except Exception as error:  # trimesh raises whatever its graphs and meshes raise
        raise CloudError(f"{name}: its scene cannot be put together: {error}") from error
    return mesh


def _sampled(mesh: Any, faces: Any, name: str, samples: int) -> PointCloud:
    try:
        corners, triangles = np.asarray(mesh.vertices, np.float64), np.asarray(faces)
        if triangles.dtype.kind not in "iu" and triangles.size:
            raise DataError(f"faces must be whole numbers, not {triangles.dtype}")
        corners, triangles = check_mesh(corners, triangles)
        check_coordinate_range(corners)
        corners, triangles = clean_mesh(corners, triangles)
        raw = sample_mesh(corners, triangles, samples) if samples else RawCloud(corners)
    except (DataError, TypeError, ValueError) as error:
        raise CloudError(f"{name}: its mesh cannot be used: {error}") from error
    return PointCloud(raw.points, raw.normals, unit=_unit(mesh), mesh=raw.mesh)


def _rows(points: Any, name: str) -> np.ndarray:
    """Points (n, 3) float64 of an array, or of what NumPy makes one of."""
    try:
        rows = np.asarray(points)
    except Exception as error:  # of rows of different lengths, or tensors on other devices
        raise CloudError(f"{name} is no array of points ({error}); {_ACCEPTED}") from error
    if rows.dtype.kind not in "iuf" or rows.ndim == 0:
        kind = type(points).__name__
        raise CloudError(f"{name} cannot be {kind} of {rows.dtype}; {_ACCEPTED}")
    if rows.ndim != 2 or rows.shape[1] != 3:
        raise CloudError(
            f"{name} is an array of shape {rows.shape}, not (n, 3); give normals as "
            f"PointCloud(points, normals); {_ACCEPTED}"
        )
    return np.asarray(rows, np.float64)


def _normals(given: Any, name: str) -> np.ndarray | None:
    """Normals (n, 3) of Open3D's cloud, which has none as an empty list."""
    found = getattr(given, "normals", None)
    if found is None or len(found) == 0:
        return None
    return _rows(found, f"the normals of {name}")


def _unit(given: Any) -> str | None:
    """The unit that trimesh's objects may name."""
    said = getattr(given, "units", None)
    return parse_unit(said) if isinstance(said, str) else None
