"""Which reader a file needs, told from its first bytes and its name's ending."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from nrdf.errors import CloudError
from nrdf.io.formats import arrays, meshes, pcd, ply_cloud, tables
from nrdf.io.formats.raw import RawCloud

KNOWN_FORMATS = "PLY, PCD, XYZ/TXT/CSV/ASC/PTS, NPY, NPZ, OFF, OBJ, STL, GLB, ROS 2 bags"
Reader = Callable[[Path, int], RawCloud]


def detect_reader(path: Path, start: bytes, topic: str | None = None) -> Reader:
    """Reader for the file `path` that begins with the bytes `start`, or for a bag's folder.

    `topic` names what is read of a bag. Raises CloudError, listing the known formats, if there is
    no reader.
    """
    ending = path.suffix.lower()
    if path.is_dir() or start.startswith((b"\x89MCAP0", b"SQLite format 3\0")):
        from nrdf.io.formats.bag import read_bag

        return partial(read_bag, topic=topic)
    if start.startswith((b"ply\n", b"ply\r")):
        return ply_cloud.read_ply
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
