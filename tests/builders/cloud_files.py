"""The same four points as files of every format, and how a file that cannot be read is refused."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from nrdf.errors import CloudError
from nrdf.io.cloud import read_cloud

POINTS = np.array([[0.0, 1.0, 2.0], [3.5, -4.0, 5.0], [0.25, 0.5, 1e-3], [7.0, 8.0, 9.0]])
COLOURS = np.arange(12, dtype=np.uint8).reshape(4, 3)
ROWS = np.zeros(4, dtype=[("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgb", "<u4"), ("i", "<f4")])
for axis, name in enumerate("xyz"):
    ROWS[name] = POINTS[:, axis]
ROWS["rgb"] = COLOURS.astype(np.uint32) @ [1 << 16, 1 << 8, 1]
ROWS["i"] = [0.5, 1, 2, 3]
NORMALS = np.eye(3)[[0, 1, 2, 0]]
TEXT = "\n".join(" ".join(f"{v:.17g}" for v in row) for row in POINTS) + "\n"
WITH_NORMALS = "\n".join(" ".join(f"{v:.17g}" for v in row) for row in np.hstack([POINTS, NORMALS]))


def ply_header(kind="ascii", count=4, properties=("double x", "double y", "double z"), more=()):
    lines = ["ply", f"format {kind} 1.0", f"element vertex {count}"]
    lines += [f"property {p}" for p in properties]
    return "\n".join([*lines, *more, "end_header", ""]).encode()


GOOD = {
    "ascii.ply": ply_header() + TEXT.encode(),
    "no-last-line-end.ply": ply_header() + TEXT.rstrip().encode(),
    "windows.ply": (ply_header() + TEXT.encode()).replace(b"\n", b"\r\n"),
    "little.ply": ply_header("binary_little_endian") + POINTS.astype("<f8").tobytes(),
    "big.ply": ply_header("binary_big_endian") + POINTS.astype(">f8").tobytes(),
    "no-faces.ply": ply_header(more=["element face 0", "property list uchar int vertex_indices"])
    + TEXT.encode(),
    "extra.ply": ply_header(
        "binary_big_endian", properties=["uchar red", "double z", "double y", "short s", "double x"]
    )
    + b"".join(struct.pack(">Bddhd", 7, z, y, -1, x) for x, y, z in POINTS),
    "lists.ply": ply_header(
        "binary_little_endian",
        properties=["double x", "list uchar short l", "double y", "double z"],
    )
    + b"".join(struct.pack("<dB2hdd", x, 2, 5, 6, y, z) for x, y, z in POINTS),
    "ascii-lists.ply": ply_header(properties=["list uchar int l", *(f"float {a}" for a in "xyz")])
    + "".join(f"2 8 9 {x:.17g} {y:.17g} {z:.17g}\n" for x, y, z in POINTS).encode(),
    "camera-first.ply": b"ply\nformat binary_little_endian 1.0\ncomment made by hand\n"
    b"element camera 1\nproperty list uint uchar name\nproperty float fov\n"
    + ply_header("", properties=["double x", "double y", "double z"]).split(b"\n", 2)[2]
    + struct.pack("<I3sf", 3, b"abc", 1.0)
    + POINTS.astype("<f8").tobytes(),
    "a.xyz": TEXT.encode(),
    "comments.txt": b"# x y z\n// by hand\n\n" + TEXT.encode(),
    "heading.csv": b"x,y,z\n" + TEXT.replace(" ", ",").encode(),
    "semicolons.csv": TEXT.replace(" ", "; ").encode(),
    "tabs.asc": TEXT.replace(" ", "\t").encode(),
    "counted.pts": b"4\n" + TEXT.encode(),
    "colours.txt": TEXT.replace("\n", " 255 0 10\n").encode(),
    "a.off": b"OFF\n4 0 0\n" + TEXT.encode(),
    "colour.off": b"COFF\n4 0 0\n" + TEXT.replace("\n", " 1 2 3 255\n").encode(),
    "a.obj": b"# points\n" + "".join(f"v {line}\n" for line in TEXT.splitlines()).encode(),
    "ascii.pcd": b"# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\n"
    b"COUNT 1 1 1\nWIDTH 4\nHEIGHT 1\nPOINTS 4\nDATA ascii\n" + TEXT.encode(),
    "compressed.pcd": b"VERSION .7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nWIDTH 4\nHEIGHT 1\n"
    b"POINTS 4\nDATA binary_compressed\n"
    + struct.pack("<II", 96 + 3, 96)
    + b"".join(bytes([31]) + POINTS.T.astype("<f8").tobytes()[i : i + 32] for i in (0, 32, 64)),
    "binary.pcd": b"VERSION .7\nFIELDS rgb x y z\nSIZE 4 8 8 8\nTYPE U F F F\n"
    b"WIDTH 4\nHEIGHT 1\nPOINTS 4\nDATA binary\n"
    + b"".join(struct.pack("<I3d", 9, *row) for row in POINTS),
}


def check_refused(folder: Path, name: str, content: bytes, message: str) -> None:
    """Reading a file of that content must raise CloudError with the file's name and `message`."""
    (folder / name).write_bytes(content)
    with pytest.raises(CloudError, match=message) as caught:
        read_cloud(folder / name)
    assert name in str(caught.value)
