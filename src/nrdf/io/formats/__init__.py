"""The file formats that point clouds come in, each read by a function of its own.

Every reader takes the path and the number of points to sample if the file holds a mesh, and raises
CloudError if the file is truncated, damaged or not what it says it is.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from nrdf.errors import CloudError
from nrdf.geometry.units import METRES, unit_named
from nrdf.io import ply
from nrdf.io.formats import arrays, meshes, pcd, tables
from nrdf.io.formats.raw import USED, RawCloud, colours_of, intensity_of, stack

logger = logging.getLogger(__name__)

KNOWN_FORMATS = "PLY, PCD, XYZ/TXT/CSV/ASC/PTS, NPY, NPZ, OFF, OBJ, STL, GLB, ROS 2 bags"
Reader = Callable[[Path, int], RawCloud]


def reader_of(path: Path, start: bytes, topic: str | None = None) -> Reader:
    """Reader for the file `path` that begins with the bytes `start`, or for a bag's folder.

    `topic` names what is read of a bag. Raises CloudError, listing the known formats, if there is
    no reader.
    """
    ending = path.suffix.lower()
    if path.is_dir() or start.startswith((b"\x89MCAP0", b"SQLite format 3\0")):
        from nrdf.io.formats.bag import read_bag

        return partial(read_bag, topic=topic)
    if start.startswith((b"ply\n", b"ply\r")):
        return _read_ply
    if start.startswith(b"\x93NUMPY"):
        return arrays.read_npy
    if start.startswith(b"PK\x03\x04") and ending == ".npz":
        return arrays.read_npz
    if ending == ".pcd" or start.startswith(b"# .PCD"):
        return pcd.read_pcd
    if ending == ".off" or start.split(b"\n", 1)[0].strip() in (b"OFF", b"COFF", b"NOFF"):
        return meshes.read_off
    if ending == ".obj":
        return meshes.read_obj
    if ending == ".stl":
        return meshes.read_mesh
    if start.startswith(b"glTF"):
        return meshes.read_glb
    text = b"\0" not in start
    if ending in (".xyz", ".xyzn", ".txt", ".csv", ".asc", ".pts") and text:
        return tables.read_text
    raise CloudError(f"{path}: not a point cloud that can be read; known formats: {KNOWN_FORMATS}")


def _read_ply(path: Path, mesh_samples: int) -> RawCloud:
    header = ply.read_header(path)
    if header.count("face") and mesh_samples:
        cloud = meshes.read_mesh(path, mesh_samples)
    else:
        columns = ply.read_scalars(path, header, wanted=USED)
        points = stack(columns, "xyz")
        if points is None:
            has = [p.name for e in header.elements if e.name == "vertex" for p in e.properties]
            raise CloudError(
                f"{path}: its vertices have the properties {', '.join(has) or '(none)'}; "
                "x, y and z are needed as plain numbers"
            )
        cloud = RawCloud(points, stack(columns, ("nx", "ny", "nz")))
        cloud.colours, cloud.intensity = colours_of(columns), intensity_of(columns)
    for comment in header.comments:
        word, _, rest = comment.partition(" ")
        if word == "unit" and len(rest.split()) == 1:
            cloud.unit = unit_named(rest)
            if cloud.unit is None:
                known = ", ".join(METRES)
                logger.warning("%s: its unit '%s' is not known (%s)", path, rest.strip(), known)
        elif word == "frame" and rest:
            cloud.frame = rest
        elif word == "sensor":
            cloud.sensors = np.vstack([cloud.sensors, _place(path, rest)])
    return cloud


def _place(path: Path, words: str) -> np.ndarray:
    try:
        place = np.array([float(word) for word in words.split()])
    except ValueError:
        place = np.empty(0)
    if place.shape != (3,) or not np.isfinite(place).all():
        raise CloudError(f"{path}: comment 'sensor {words[:60]}': three numbers are needed")
    return place
