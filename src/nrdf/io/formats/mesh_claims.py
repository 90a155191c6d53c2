"""Checks the sizes that a mesh file claims before its parser takes memory for them.

Parsers trust counts: of elements in PLY and OFF, of accessors and instances in glTF, of members in
3MF. Here each count is compared with the file's size and with the most that is read.
"""

from __future__ import annotations

import json
import os
import struct
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, BinaryIO

from nrdf.geometry.mesh import MAX_FACES
from nrdf.io import ply
from nrdf.io.rows import count_rows

_MOST_DESCRIPTION = 50_000_000  # bytes of a file in JSON or XML, which takes many times its size
_FEWEST_STL = 84  # bytes of a binary STL without faces
_STL_FACE, _STL_FACE_TEXT = 50, 90  # bytes, the latter at least
_COMPONENTS = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
_VALUES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_POINTS_FOR_A_FACE = 20  # lone points that take as much memory as a face
_DEEPEST = 200  # nodes above each other in a scene


def check_claimed_sizes(path: Path, file: BinaryIO) -> None:
    """Raise ValueError or CloudError if the open mesh file claims what it cannot hold, or more than
    is read. The place in the file may move."""
    size = os.fstat(file.fileno()).st_size
    ending = path.suffix.lower()
    faces = 0
    if ending == ".ply":
        faces = ply.read_header(path).count("face")
    elif ending == ".obj":
        # A polygon of k corners becomes k - 2 triangles.
        faces = sum(len(line.split()) - 3 for line in file if line[:2] in (b"f ", b"f\t"))
    elif ending == ".off":
        faces = off_counts(file)[1]
    elif ending == ".stl":
        text = file.read(_FEWEST_STL).lstrip().startswith(b"solid")
        faces = size // (_STL_FACE_TEXT if text else _STL_FACE)
    elif ending == ".glb":
        faces = _check_gltf(_json_of_glb(file), size)
    else:
        if ending == ".3mf":
            with zipfile.ZipFile(file) as archive:
                size = sum(info.file_size for info in archive.infolist())
        if size > _MOST_DESCRIPTION:
            raise ValueError(f"{size / 1e6:.0f} MB; at most {_MOST_DESCRIPTION / 1e6:.0f} are read")
        if ending == ".gltf":
            tree = json.load(file)
            outside = _bytes_beside(path, tree)
            faces = _check_gltf(tree, size + outside)
    if faces > MAX_FACES:
        raise ValueError(f"{faces} faces; at most {MAX_FACES} are used: simplify the mesh")


def off_counts(file: BinaryIO) -> tuple[int, int]:
    """Points and faces that an OFF file's header claims; the place is where its rows begin.

    Raises ValueError if there is no such header, or if the file has more rows or fewer.
    """
    words: list[bytes] = []
    while len(words) < 4:
        line = file.readline(4096)
        if not line:
            raise ValueError("damaged OFF header: no counts")
        words += line.removeprefix(b"\xef\xbb\xbf").split(b"#")[0].split()
        if words and not words[0].endswith(b"OFF"):
            raise ValueError("not an OFF file: it does not begin with OFF")
    points, faces = int(words[1]), int(words[2])
    left = os.fstat(file.fileno()).st_size - file.tell()
    if not (0 <= points <= left // 6 + 1 and 0 <= faces <= left // 4 + 1):
        raise ValueError(f"truncated: {points} points, {faces} faces are more than the file holds")
    start = file.tell()
    rows = count_rows(file, points + faces)
    file.seek(start)
    if rows != points + faces:
        what = "truncated: " if rows < points + faces else "more rows than it claims: "
        raise ValueError(f"{what}{rows} rows for {points} points and {faces} faces")
    return points, faces


def _json_of_glb(file: BinaryIO) -> Any:
    size = os.fstat(file.fileno()).st_size
    head = file.read(20)
    if len(head) < 20 or head[:4] != b"glTF" or head[16:20] != b"JSON":
        raise ValueError("no GLB header of version 2")
    length = struct.unpack("<I", head[12:16])[0]
    if length > min(size - 20, _MOST_DESCRIPTION):
        raise ValueError(f"truncated: {length} bytes of description")
    return json.loads(file.read(length))


def _bytes_beside(path: Path, tree: Any) -> int:
    """Bytes of the files beside a .gltf that its buffers name."""
    names = [buffer.get("uri", "") for buffer in _items(tree, "buffers")]
    files = [path.parent / name for name in names if not str(name).startswith("data:")]
    return sum(file.stat().st_size for file in files if file.is_file())


def _check_gltf(tree: Any, size: int) -> int:
    """Faces of a glTF scene with all its instances; lone points count for a fraction of one.

    Raises ValueError if an accessor is larger than the file, or the nodes are no trees.
    """
    counts = []
    for accessor in _items(tree, "accessors"):
        count = accessor.get("count")
        value = _COMPONENTS.get(accessor.get("componentType"), 0)
        value *= _VALUES.get(accessor.get("type"), 0)
        if not isinstance(count, int) or count < 0 or value == 0 or "sparse" in accessor:
            raise ValueError("damaged: an accessor without count or type, or a sparse one")
        if count * value > size:
            raise ValueError(f"truncated: an accessor of {count} values is more than it holds")
        counts.append(count)
    meshes = []
    for mesh in _items(tree, "meshes"):
        faces = 0
        for part in _items(mesh, "primitives"):
            points = _at(counts, part.get("attributes", {}).get("POSITION"))
            corners = _at(counts, part["indices"]) if "indices" in part else points
            faces += max(points, corners) // (_POINTS_FOR_A_FACE if part.get("mode") == 0 else 3)
        meshes.append(faces)
    nodes = _items(tree, "nodes")
    children = [child for node in nodes for child in node.get("children", [])]
    if len(set(children)) < len(children):
        raise ValueError("damaged: a node of its scene stands at two places")
    depth = _depth(nodes)
    if depth > _DEEPEST:
        raise ValueError("damaged: the nodes of its scene are in a circle, or too deep")
    total = sum(_at(meshes, node["mesh"]) for node in nodes if "mesh" in node)
    return max(total, sum(meshes))


def _depth(nodes: Sequence[Any]) -> int:
    """The longest chain of nodes below each other, as far as it matters."""
    level = set(range(len(nodes)))
    for depth in range(_DEEPEST + 2):
        if not level:
            return depth
        level = {c for n in level for c in nodes[n].get("children", []) if c < len(nodes)}
    return _DEEPEST + 1


def _items(tree: Any, name: str) -> list[Any]:
    """The mappings listed under a name. Raises ValueError if there is something else."""
    items = tree.get(name, []) if isinstance(tree, dict) else None
    if not isinstance(items, list) or not all(isinstance(item, dict) for item in items):
        raise ValueError(f"damaged: its {name} are no list of objects")
    return items


def _at(values: Sequence[int], index: Any) -> int:
    if not isinstance(index, int) or not 0 <= index < len(values):
        raise ValueError(f"damaged: it names number {index!r:.40} of {len(values)}")
    return values[index]
