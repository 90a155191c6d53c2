"""Meshes and the vertices of meshes: OFF, OBJ, and whatever trimesh reads.

A mesh is sampled evenly over what is visible from outside: its vertices would be a poor cloud.
"""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import numpy as np

from nrdf.errors import CloudError, DataError
from nrdf.formats.raw import RawCloud

logger = logging.getLogger(__name__)


def read_off(path: Path, mesh_samples: int) -> RawCloud:
    with open(path, "rb") as file:
        words: list[bytes] = []
        while len(words) < 4:
            line = file.readline(4096)
            if not line:
                raise CloudError(f"{path}: damaged OFF header: no counts")
            words += line.split(b"#")[0].split()
            if words and not words[0].endswith(b"OFF"):
                raise CloudError(f"{path}: not an OFF file: it does not begin with OFF")
        try:
            points, faces = int(words[1]), int(words[2])
            if faces and mesh_samples:
                return read_mesh(path, mesh_samples)
            if not 0 <= points <= path.stat().st_size // 6 + 1:
                raise ValueError(f"truncated: {points} points are more than the file holds")
            table = np.loadtxt(file, max_rows=points, usecols=(0, 1, 2), ndmin=2)
            if len(table) != points:
                raise ValueError(f"truncated: {len(table)} of {points} points")
        except ValueError as error:
            raise CloudError(f"{path}: damaged OFF file: {error}") from error
    return RawCloud(table)


def read_obj(path: Path, mesh_samples: int) -> RawCloud:
    vertices: list[list[float]] = []
    with open(path, encoding="utf-8", errors="replace") as file:
        for line in file:
            if mesh_samples and line.startswith("f "):
                return read_mesh(path, mesh_samples)
            if line.startswith("v "):
                try:
                    vertices.append([float(word) for word in line.split()[1:4]])
                except ValueError as error:
                    raise CloudError(f"{path}: damaged OBJ line '{line.strip()[:60]}'") from error
    if any(len(vertex) != 3 for vertex in vertices):
        raise CloudError(f"{path}: damaged OBJ file: a vertex needs three coordinates")
    return RawCloud(np.array(vertices, dtype=np.float64).reshape(-1, 3))


def read_mesh(path: Path, samples: int) -> RawCloud:
    """Sample the visible surface of the mesh `path` evenly, the same points every time."""
    from nrdf.mesh import Mesh, load_mesh, outer_skin

    try:
        vertices, faces = load_mesh(path)
        skin = outer_skin(vertices, faces, samples, np.random.default_rng(0))[1]
    except DataError as error:
        raise CloudError(str(error)) from error
    logger.info("%s is a mesh: sampled %d points of its surface", path, len(skin.points))
    return RawCloud(skin.points, skin.normals, mesh=Mesh(vertices, faces))


def read_glb(path: Path, samples: int) -> RawCloud:
    """Binary glTF, whose unit is the metre: its meshes, or its points where it has no faces."""
    import trimesh

    try:
        scene = trimesh.load_scene(path, process=False)
    except Exception as error:  # trimesh raises whatever its parsers raise
        raise CloudError(f"{path}: truncated or damaged GLB file ({error})") from error
    parts: list[Any] = scene.dump() if scene.geometry else []
    if any(len(getattr(part, "faces", ())) for part in parts):
        cloud = read_mesh(path, samples)
    else:
        vertices = [np.asarray(part.vertices, np.float64) for part in parts]
        cloud = RawCloud(np.concatenate(vertices) if vertices else np.empty((0, 3)))
    cloud.unit = "m"
    return cloud
