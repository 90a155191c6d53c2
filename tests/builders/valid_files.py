"""A small valid file of every format that clouds and meshes come in, to be damaged."""

from __future__ import annotations

import io
import struct

import numpy as np
import trimesh

POINTS = np.array([[0.0, 1.0, 2.0], [3.5, -4.0, 5.0], [0.25, 0.5, 1.0], [7.0, 8.0, 9.0]])
NORMALS = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, -1]])
COLOURS = np.arange(12, dtype=np.uint8).reshape(4, 3)
CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def _text(rows: np.ndarray, delimiter: str = " ") -> str:
    return "".join(delimiter.join(f"{v:.9g}" for v in row) + "\n" for row in rows)


def _ply(kind: str, faces: bool = False) -> bytes:
    points = CORNERS if faces else POINTS
    lines = ["ply", f"format {kind} 1.0", "comment unit mm", "comment sensor 1 2 3"]
    lines += ["element vertex 4", *(f"property float {name}" for name in "xyz")]
    if faces:
        lines += ["element face 4", "property list uchar int vertex_indices"]
    body = ("\n".join([*lines, "end_header"]) + "\n").encode()
    if kind == "ascii":
        body += _text(points).encode()
        return body + _text(np.c_[np.full(4, 3), FACES]).encode() * faces
    order = "<" if "little" in kind else ">"
    body += points.astype(order + "f4").tobytes()
    return body + b"".join(b"\3" + f.astype(order + "i4").tobytes() for f in FACES) * faces


def _pcd(kind: str) -> bytes:
    rows = np.zeros(4, dtype=[(n, "<f4") for n in "xyz"] + [("rgb", "<u4"), ("intensity", "<f4")])
    for axis, name in enumerate("xyz"):
        rows[name] = POINTS[:, axis]
    rows["rgb"] = COLOURS.astype(np.uint32) @ [1 << 16, 1 << 8, 1]
    head = (
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z rgb intensity\nSIZE 4 4 4 4 4\nTYPE F F F U F\n"
        "COUNT 1 1 1 1 1\nWIDTH 4\nHEIGHT 1\nVIEWPOINT 1 2 3 1 0 0 0\nPOINTS 4\n"
        f"DATA {kind}\n"
    ).encode()
    if kind == "ascii":
        return head + "".join(" ".join(map(str, row.tolist())) + "\n" for row in rows).encode()
    if kind == "binary":
        return head + rows.tobytes()
    raw = b"".join(rows[name].tobytes() for name in rows.dtype.names)
    pieces = (raw[i : i + 32] for i in range(0, len(raw), 32))
    packed = b"".join(bytes([len(piece) - 1]) + piece for piece in pieces)
    return head + struct.pack("<II", len(packed), len(raw)) + packed


def _numpy(save, *arrays, **named) -> bytes:
    file = io.BytesIO()
    save(file, *arrays, **named)
    return file.getvalue()


def _mesh(kind: str) -> bytes:
    made = trimesh.Trimesh(CORNERS, FACES, process=False).export(file_type=kind)
    return made if isinstance(made, bytes) else made.encode()


_NAMED = {"normals": NORMALS, "colours": COLOURS, "unit": "mm", "frame": "cell"}

CLOUDS: dict[str, bytes] = {
    "ascii.ply": _ply("ascii"),
    "little.ply": _ply("binary_little_endian"),
    "big.ply": _ply("binary_big_endian"),
    "ascii.pcd": _pcd("ascii"),
    "binary.pcd": _pcd("binary"),
    "compressed.pcd": _pcd("binary_compressed"),
    "a.xyz": _text(POINTS).encode(),
    "normals.txt": _text(np.hstack([POINTS, NORMALS])).encode(),
    "named.csv": b"y [mm],x [mm],z [mm],i\n" + _text(np.c_[POINTS, [1, 2, 3, 4]], ",").encode(),
    "a.pts": b"4\n" + _text(np.hstack([POINTS, [[5]] * 4, COLOURS])).encode(),
    "a.npy": _numpy(np.save, POINTS),
    "fortran.npy": _numpy(np.save, np.asfortranarray(POINTS.astype(">f4"))),
    "a.npz": _numpy(np.savez, points=POINTS, **_NAMED),
    "packed.npz": _numpy(np.savez_compressed, points=POINTS, intensity=np.arange(4.0)),
    "points.off": f"OFF\n4 0 0\n{_text(POINTS)}".encode(),
    "points.obj": "".join(f"v {row}\n" for row in _text(POINTS).splitlines()).encode(),
    "points.glb": trimesh.Scene(trimesh.PointCloud(POINTS)).export(file_type="glb"),
}  # fmt: skip

MESHES: dict[str, bytes] = {
    "ascii-mesh.ply": _ply("ascii", faces=True),
    "little-mesh.ply": _ply("binary_little_endian", faces=True),
    "a.off": _mesh("off"),
    "a.obj": _mesh("obj"),
    "a.stl": _mesh("stl"),
    "ascii.stl": _mesh("stl_ascii"),
    "a.glb": _mesh("glb"),
}
