"""Meshes and the vertices of meshes: OFF, OBJ, and whatever trimesh reads.

A mesh is sampled evenly over what is visible from outside: its vertices would be a poor cloud.
"""

from __future__ import annotations

import logging
from array import array
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from nrdf.errors import CloudError, DataError
from nrdf.geometry.loose_triangles import check_surface
from nrdf.geometry.mesh import Mesh, outer_skin
from nrdf.io.files import open_file
from nrdf.io.formats.mesh_claims import check_claimed_sizes, off_counts
from nrdf.io.formats.mesh_file import load_mesh
from nrdf.io.formats.raw import RawCloud
from nrdf.io.rows import text_rows

logger = logging.getLogger(__name__)


def read_off(path: Path, mesh_samples: int) -> RawCloud:
    with open_file(path, CloudError) as file:
        try:
            points, faces = off_counts(file)
            if faces and mesh_samples:
                return read_mesh(path, mesh_samples)
            if points == 0:
                return RawCloud(np.empty((0, 3)))
            rows = islice(text_rows(file), points)
            table = np.loadtxt(rows, usecols=(0, 1, 2), ndmin=2, comments="#")
        except ValueError as error:
            raise CloudError(f"{path}: damaged OFF file: {error}") from error
    return RawCloud(table)


def read_obj(path: Path, mesh_samples: int) -> RawCloud:
    values = array("d")
    with open_file(path, CloudError) as file:
        for line in file:
            words = line.removeprefix(b"\xef\xbb\xbf").split(maxsplit=4)
            if mesh_samples and words[:1] == [b"f"]:
                return read_mesh(path, mesh_samples)
            if words[:1] == [b"v"]:
                try:
                    values.extend([float(words[1]), float(words[2]), float(words[3])])
                except (ValueError, IndexError):
                    shown = line.decode("utf-8", errors="replace").strip()[:60]
                    raise CloudError(
                        f"{path}: damaged OBJ line '{shown}': a vertex needs three coordinates"
                    ) from None
    return RawCloud(np.frombuffer(values, np.float64).reshape(-1, 3).copy())


def read_mesh(path: Path, samples: int) -> RawCloud:
    """The visible surface of the mesh `path`, sampled evenly, or its vertices with `samples` 0."""
    try:
        vertices, faces = load_mesh(path)
    except DataError as error:
        raise CloudError(str(error)) from error
    if not samples:
        return RawCloud(vertices)
    try:
        cloud = sample_mesh(vertices, faces, samples)
    except DataError as error:
        raise CloudError(f"{path}: {error}") from error
    logger.info("%s is a mesh: sampled %d points of its surface", path, samples)
    return cloud


def sample_mesh(vertices: np.ndarray, faces: np.ndarray, samples: int) -> RawCloud:
    """`samples` points of the visible surface of a mesh that was checked, with outward normals;
    the same points every time. Raises DataError for triangles that are no surface
    (`nrdf.geometry.loose_triangles`), and if too little of it is seen."""
    check_surface(vertices, faces)
    skin = outer_skin(vertices, faces, samples, np.random.default_rng(0))[1]
    return RawCloud(skin.points, skin.normals, mesh=Mesh(vertices, faces))


def read_glb(path: Path, samples: int) -> RawCloud:
    """Binary glTF, whose unit is the metre: its meshes, or its points where it has no faces."""
    import trimesh

    with open_file(path, CloudError) as file:
        try:
            check_claimed_sizes(path.with_suffix(".glb"), file)
            file.seek(0)
            scene = trimesh.load_scene(file, file_type="glb", process=False, skip_materials=True)
            parts: list[Any] = scene.dump() if scene.geometry else []
            lone = [np.asarray(part.vertices, np.float64) for part in parts]
            faces = sum(len(getattr(part, "faces", ())) for part in parts)
        except Exception as error:  # trimesh raises whatever its parsers raise
            why = str(error) or type(error).__name__
            raise CloudError(f"{path}: truncated or damaged GLB file: {why}") from error
    del scene, parts
    if faces:
        cloud = read_mesh(path, samples)
    else:
        cloud = RawCloud(np.concatenate(lone).reshape(-1, 3) if lone else np.empty((0, 3)))
    cloud.unit = "m"
    return cloud
