"""Every kind of damaged or awkward file that readers once fell over, or read wrongly in silence."""

from __future__ import annotations

import io
import json
import os
import re
import socket
import struct
import zipfile

import numpy as np
import pytest
import trimesh

from builders.fuzzing import message_of, outcome_of
from builders.valid_files import CLOUDS, COLOURS, MESHES, NORMALS, POINTS
from nrdf.errors import RegionError
from nrdf.io.cloud import PointCloud, read_cloud
from nrdf.regions.files import read_region_file

BOX = trimesh.creation.box()


def text(rows=POINTS, delimiter=" "):
    return "".join(delimiter.join(map(repr, row)) + "\n" for row in rows.tolist())


def npy(header: str, data: bytes = b"", version=(1, 0)) -> bytes:
    return b"\x93NUMPY" + bytes(version) + struct.pack("<H", len(header)) + header.encode() + data


def npz(**arrays) -> bytes:
    file = io.BytesIO()
    np.savez_compressed(file, **{"points": POINTS, **arrays})
    return file.getvalue()


def archive(members: dict[str, bytes], method=zipfile.ZIP_DEFLATED) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", method) as out:
        for name, content in members.items():
            out.writestr(name, content)
    return file.getvalue()


def bomb(names=("points",)) -> bytes:
    """An archive whose arrays claim 1.2 GB each, in their own header and in the archive's."""
    header = "{'descr': '<f8', 'fortran_order': False, 'shape': (50000000, 3)}"
    content = bytearray(archive({f"{name}.npy": npy(header) for name in names}))
    place = content.find(b"PK\x01\x02")
    while place >= 0:
        struct.pack_into("<I", content, place + 24, 1_200_000_000 + len(npy(header)))
        place = content.find(b"PK\x01\x02", place + 1)
    return bytes(content)


def changed(content: bytes, old: bytes, new: bytes) -> bytes:
    assert old in content
    return content.replace(old, new)


def obj(scale=1.0, faces="f 1 2 3\n") -> bytes:
    return ("".join(f"v {a!r} {b!r} {c!r}\n" for a, b, c in (POINTS * scale).tolist())).encode() + (
        faces.encode()
    )


def stl(scale: float) -> bytes:
    mesh = BOX.copy()
    mesh.vertices *= scale
    return mesh.export(file_type="stl")


def glb(change) -> bytes:
    """A box as GLB, its description changed."""
    content = trimesh.Scene(BOX).export(file_type="glb")
    length = struct.unpack("<I", content[12:16])[0]
    tree = json.loads(content[20 : 20 + length])
    change(tree)
    chunk = json.dumps(tree).encode()
    chunk += b" " * (-len(chunk) % 4)
    rest = content[20 + length :]
    head = struct.pack("<4sIIII", b"glTF", 2, 20 + len(chunk) + len(rest), len(chunk), 0x4E4F534A)
    return head + chunk + rest


def accessor(count):
    def change(tree):
        tree["accessors"][0]["count"] = count
        del tree["accessors"][0]["bufferView"]

    return change


def laughs(tree):
    """Nodes that each hold the next one twice: 2^25 boxes."""
    mesh = next(node["mesh"] for node in tree["nodes"] if "mesh" in node)
    tree["nodes"] = [{"children": [i + 1, i + 1]} for i in range(25)] + [{"mesh": mesh}]
    tree["scenes"] = [{"nodes": [0]}]


def many(tree):
    mesh = next(node["mesh"] for node in tree["nodes"] if "mesh" in node)
    tree["nodes"] = [{"mesh": mesh}] * 400_000
    tree["scenes"] = [{"nodes": list(range(400_000))}]


def circle(tree):
    tree["nodes"] = [{"children": [1]}, {"children": [0]}]
    tree["scenes"] = [{"nodes": [0]}]


def pcd(content: bytes, count: int) -> bytes:
    """A PCD of four points that claims another number."""
    for name in (b"POINTS", b"WIDTH"):
        content = changed(content, name + b" 4", name + f" {count}".encode())
    return content


def csv(heading: str, rows=POINTS) -> bytes:
    return f"{heading}\n{text(rows, ',')}".encode()


PLY, PCD, PACKED = CLOUDS["ascii.ply"], CLOUDS["ascii.pcd"], CLOUDS["compressed.pcd"]
SHAPE = "{'descr': '<f8', 'fortran_order': False, 'shape': (4, 3)}"

REFUSED: dict[str, tuple[str, bytes, str]] = {
    "npy header cut": ("a.npy", npy("{'descr': '<f8', 'shape': (4, 3"), "plain NumPy array"),
    "npy header with a bracket": ("a.npy", npy("{'descr': '<f8', ((((["), "plain NumPy array"),
    "npy header very deep": ("a.npy", npy("(" * 9000), "plain NumPy array"),
    "npy header without keys": ("a.npy", npy("{'descr': '<f8'}"), "plain NumPy array"),
    "npy with too many points": ("a.npy", npy(SHAPE.replace("4", "4" * 12)), "more than the file"),
    "npy with negative points": ("a.npy", npy(SHAPE.replace("4", "-4")), "plain NumPy array"),
    "npy of objects": ("a.npy", npy(SHAPE.replace("<f8", "O")), "plain numbers"),
    "npy version 3": ("a.npy", npy(SHAPE, POINTS.tobytes(), (3, 0)), "plain NumPy array"),
    "npz encrypted": (
        "a.npz",
        changed(npz(), b"PK\x01\x02-\x03-\x00\x00\x00", b"PK\x01\x02-\x03-\x00\x01\x00"),
        "truncated or not plain",
    ),
    "npz packed in an unknown way": (
        "a.npz",
        changed(
            npz(), b"PK\x01\x02-\x03-\x00\x00\x00\x08\x00", b"PK\x01\x02-\x03-\x00\x00\x00\x63\x00"
        ),
        "truncated or not plain",
    ),
    "npz that unpacks to 1.2 GB": ("a.npz", bomb(), "unpack to more than"),
    "npz with more than it has": (
        "a.npz",
        archive({"points.npy": npy(SHAPE.replace("4", "4" * 12))}),
        "more than the file",
    ),
    "npz with normals in words": (
        "a.npz",
        npz(normals=NORMALS.astype(str)),
        "'normals' must be numbers",
    ),
    "npz with structured normals": (
        "a.npz",
        npz(normals=np.zeros(4, dtype=[("x", "f8"), ("y", "f8")])),
        "plain numbers are needed",
    ),
    "npz with other normals": (
        "a.npz",
        npz(normals=NORMALS[:3]),
        r"'normals' must be numbers \(n, 3\) for n = 4",
    ),
    "npz with words for colours": (
        "a.npz",
        npz(colours=COLOURS.astype(str)),
        "'colours' must be numbers",
    ),
    "npz with other intensities": (
        "a.npz",
        npz(intensity=np.zeros((4, 2))),
        "'intensity' must be numbers",
    ),
    "npz with a number for a unit": ("a.npz", npz(unit=3.0), "'unit' must be a word"),
    "npz in feet": ("a.npz", npz(unit="ft"), "its unit is 'ft'; known: m, cm, mm, in"),
    "npz with objects": ("a.npz", npz(points=np.array([None, 1])), "plain numbers"),
    "obj with a face of two": ("a.obj", obj(faces="f 1 2\n"), "no faces"),
    "obj vertex of two": ("a.obj", b"v 1 2\nv 1 2 3\n", "three coordinates"),
    "obj beyond all sizes": ("a.obj", obj(1e200), "coordinates of"),
    "stl beyond all sizes": ("a.stl", stl(1e30), "coordinates of"),
    "xyz beyond all sizes": ("a.xyz", text(POINTS * 1e300).encode(), "coordinates of"),
    "pcd with a huge COUNT": (
        "a.pcd",
        changed(CLOUDS["binary.pcd"], b"COUNT 1 1 1 1 1", b"COUNT 1 1 1 1 999999999999"),
        "bytes",
    ),
    "ascii pcd with a huge COUNT": (
        "a.pcd",
        changed(PCD, b"COUNT 1 1 1 1 1", b"COUNT 1 1 1 1 9999"),
        "more than it holds",
    ),
    "pcd with too many POINTS": (
        "a.pcd",
        pcd(CLOUDS["binary.pcd"], 190000000),
        "truncated: 4 of",
    ),
    "pcd whose sizes contradict": (
        "a.pcd",
        changed(PCD, b"WIDTH 4", b"WIDTH 3"),
        "is not POINTS 4",
    ),
    "pcd with too few POINTS": (
        "a.pcd",
        pcd(PCD, 3),
        "more than the 3 points",
    ),
    "binary pcd with too few POINTS": (
        "a.pcd",
        pcd(CLOUDS["binary.pcd"], 3),
        "more than the 3 points",
    ),
    "pcd of whole numbers with decimals": (
        "a.pcd",
        changed(PCD, b"TYPE F F F", b"TYPE F I F"),
        "field y is declared as int32",
    ),
    "pcd of bytes above 255": (
        "a.pcd",
        b"FIELDS x y z\nSIZE 1 1 1\nTYPE U U U\nPOINTS 1\nDATA ascii\n1 2 300\n",
        "declared as uint8",
    ),
    "pcd that claims to unpack to more": (
        "a.pcd",
        pcd(PACKED[: PACKED.index(b"compressed\n") + 11], 100_000_000)
        + struct.pack("<II", 8, 2_000_000_000)
        + b"x" * 8,
        "truncated",
    ),
    "ply with fewer rows claimed": (
        "a.ply",
        changed(PLY, b"vertex 4", b"vertex 3"),
        "the file holds more",
    ),
    "binary ply with fewer rows claimed": (
        "a.ply",
        changed(CLOUDS["little.ply"], b"vertex 4", b"vertex 3"),
        "the file holds more",
    ),
    "mesh ply with fewer faces claimed": (
        "a.ply",
        changed(MESHES["ascii-mesh.ply"], b"face 4", b"face 3"),
        "the file holds more",
    ),
    "ply with a count of 5000 digits": (
        "a.ply",
        changed(PLY, b"vertex 4", b"vertex " + b"9" * 5000),
        "cannot understand",
    ),
    "off with fewer rows claimed": (
        "a.off",
        changed(CLOUDS["points.off"], b"4 0 0", b"3 0 0"),
        "more rows",
    ),
    "mesh off with fewer rows claimed": (
        "a.off",
        changed(MESHES["a.off"], b"4 4 ", b"4 3 "),
        "more rows",
    ),
    "pts with fewer rows claimed": (
        "a.pts",
        changed(CLOUDS["a.pts"], b"4\n0", b"3\n0"),
        "claims 3 points, but 4",
    ),
    "pts with more rows claimed": (
        "a.pts",
        changed(CLOUDS["a.pts"], b"4\n0", b"5\n0"),
        "claims 5 points, but 4",
    ),
    "csv in an unknown unit": ("a.csv", csv("x [px],y [px],z [px]"), "not all known"),
    "csv with the unit of one axis": ("a.csv", csv("x [mm],y,z"), "not all known"),
    "csv that names two axes": ("a.csv", csv("y,x,height"), "names y and x alone"),
    "csv with a name too many": ("a.csv", csv("id,y,x,z"), "names 4 columns"),
    "csv that names an axis twice": (
        "a.csv",
        csv("x,y,z,x", np.c_[POINTS, POINTS[:, :1]]),
        "names 4",
    ),
    "first row damaged": ("a.xyz", b"0x 1 2\n" + text().encode(), "damaged row '0x 1 2'"),
    "glb accessor without data": ("a.glb", glb(accessor(10**9)), "more than it holds"),
    "glb accessor of -1": ("a.glb", glb(accessor(-1)), "accessor without count"),
    "glb with 2^25 boxes": ("a.glb", glb(laughs), "at two places"),
    "glb with 400,000 boxes": ("a.glb", glb(many), "faces; at most"),
    "glb in a circle": ("a.glb", glb(circle), "circle"),
    "glb of another kind": (
        "a.glb",
        glb(lambda tree: tree.update(accessors={"count": 3})),
        "no list",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_is_refused_with_the_reason(tmp_path, case):
    name, content, reason = REFUSED[case]
    (tmp_path / name).write_bytes(content)
    message = message_of(lambda: read_cloud(tmp_path / name))
    assert name in message
    assert re.search(reason, message), message


BOM = b"\xef\xbb\xbf"
ROWS = text().encode()
READ: dict[str, tuple[str, bytes]] = {
    "xyz with a byte-order mark": ("a.xyz", BOM + ROWS),
    "obj with a byte-order mark": ("a.obj", BOM + CLOUDS["points.obj"]),
    "obj with tabs and spaces": ("a.obj", CLOUDS["points.obj"].replace(b"v 3.5 ", b"  v\t3.5 ")),
    "off with a byte-order mark": ("a.off", BOM + CLOUDS["points.off"]),
    "off with comments": ("a.off", CLOUDS["points.off"].replace(b"\n0", b"\n# a point:\n0")),
    "pcd with a byte-order mark": ("a.pcd", BOM + PCD),
    "csv with axes in another order": ("a.csv", csv("y,x,z", POINTS[:, [1, 0, 2]])),
    "csv with a mark and a quoted heading": (
        "a.csv", BOM + b'"Y";"X";"Z"\r\n' + text(POINTS[:, [1, 0, 2]], ";").encode(),
    ),
    "csv with positions": ("a.csv", csv("position_z,Position.x,pos y", POINTS[:, [2, 0, 1]])),
    "xyz with windows' line ends": ("a.xyz", ROWS.replace(b"\n", b"\r\n")),
    "xyz with blank lines": ("a.xyz", b"\n\n" + ROWS.replace(b"\n", b"\n\n")),
    "csv with a last comma": ("a.csv", ROWS.replace(b" ", b",").replace(b"\n", b",\n")),
    "ply with blank lines at its end": ("a.ply", PLY + b"\n \n"),
    "pcd without sizes": ("a.pcd", changed(changed(PCD, b"WIDTH 4\n", b""), b"HEIGHT 1\n", b"")),
}  # fmt: skip


@pytest.mark.parametrize("case", READ)
def test_is_read_right(tmp_path, case):
    name, content = READ[case]
    (tmp_path / name).write_bytes(content)
    np.testing.assert_allclose(read_cloud(tmp_path / name).points, POINTS)


@pytest.mark.parametrize(
    ("heading", "order", "unit", "scale"),
    [
        ("y [mm],x [mm],z [mm]", [1, 0, 2], "mm", 1),
        ("Z (cm), Y (cm), X (cm)", [2, 1, 0], "cm", 1),
        ("x_m,y_m,z_m", [0, 1, 2], "m", 1),
        ("X [inch],Y [inch],Z [inch]", [0, 1, 2], "in", 1),
        ("x [m],y [mm],z [cm]", [0, 1, 2], "m", [1, 1e-3, 1e-2]),
    ],
)
def test_a_heading_with_units_is_followed(tmp_path, heading, order, unit, scale):
    for delimiter in ",; ":
        columns = heading.replace(",", delimiter)
        (tmp_path / "a.csv").write_text(f"# {columns}\n{text(POINTS[:, order], delimiter)}")
        cloud = read_cloud(tmp_path / "a.csv")
        np.testing.assert_allclose(cloud.points, POINTS * scale)
        assert cloud.unit == unit


def test_a_heading_that_names_no_axes_is_reported(tmp_path, caplog):
    (tmp_path / "a.csv").write_text("east,north,up\n" + text(delimiter=","))
    np.testing.assert_array_equal(read_cloud(tmp_path / "a.csv").points, POINTS)
    assert "the first three columns are taken" in caplog.text


def test_a_mesh_with_a_byte_order_mark_keeps_its_first_vertex(tmp_path):
    (tmp_path / "a.obj").write_bytes(BOM + BOX.export(file_type="obj").encode())
    points = read_cloud(tmp_path / "a.obj", mesh_samples=2000).points
    np.testing.assert_allclose([points.min(0), points.max(0)], [[-0.5] * 3, [0.5] * 3], atol=0.02)


@pytest.mark.parametrize(
    "faces", ["f 1 2\nf 1 2 3\n", "f 1\n", "f 1 2 3\nf 1 2\n", "f\n", "f x y z\n"]
)
def test_odd_faces_are_read_or_refused(tmp_path, faces):
    (tmp_path / "a.obj").write_bytes(obj(faces=faces))
    outcome_of(lambda: read_cloud(tmp_path / "a.obj", mesh_samples=50))


def test_vertices_of_stl_and_glb_can_be_asked_for(tmp_path):
    for ending in ("stl", "glb"):
        (tmp_path / f"a.{ending}").write_bytes(BOX.export(file_type=ending))
        assert len(read_cloud(tmp_path / f"a.{ending}", mesh_samples=0)) == 8


def test_a_mesh_names_no_other_file(tmp_path):
    """A material that is a pipe would be waited for."""
    os.mkfifo(tmp_path / "pipe.mtl")
    content = BOX.export(file_type="obj")
    (tmp_path / "a.obj").write_text(f"mtllib pipe.mtl\nusemtl x\n{content}")
    assert isinstance(outcome_of(lambda: read_cloud(tmp_path / "a.obj", 50), seconds=5), PointCloud)
    content = MESHES["ascii-mesh.ply"].replace(b"comment unit mm", b"comment TextureFile pipe.mtl")
    (tmp_path / "a.ply").write_bytes(content)
    assert isinstance(outcome_of(lambda: read_cloud(tmp_path / "a.ply", 50), seconds=5), PointCloud)


@pytest.mark.parametrize("ending", ["ply", "npy", "npz", "obj", "stl", "glb", "pcd", "xyz", "mcap"])
def test_what_is_no_file_is_refused_at_once(tmp_path, ending, monkeypatch):
    name = f"a.{ending}"
    os.mkfifo(tmp_path / name)
    message = message_of(lambda: read_cloud(tmp_path / name))
    assert name in message and "pipe" in message
    if ending in ("npy", "npz", "ply"):
        assert "pipe" in message_of(lambda: read_region_file(tmp_path / name))
    (tmp_path / name).unlink()
    (tmp_path / name).symlink_to("/dev/zero")
    assert "device" in message_of(lambda: read_cloud(tmp_path / name))
    monkeypatch.chdir(tmp_path)
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(f"s.{ending}")
        assert "socket" in message_of(lambda: read_cloud(f"s.{ending}"))
    (tmp_path / f"b.{ending}").mkdir()
    assert "folder" in message_of(lambda: read_cloud(tmp_path / f"b.{ending}"))
    assert "cannot read" in message_of(lambda: read_cloud(f"a\0.{ending}"))


def test_a_bag_with_a_pipe_or_a_merging_description_is_refused(tmp_path):
    (tmp_path / "metadata.yaml").write_text("a: &a {b: 1}\nc: {<<: [*a, *a]}\n")
    assert "merges keys" in message_of(lambda: read_cloud(tmp_path))
    (tmp_path / "metadata.yaml").write_text("rosbag2_bagfile_information: {}\n")
    os.mkfifo(tmp_path / "bag.mcap")
    assert "pipe" in message_of(lambda: read_cloud(tmp_path))


@pytest.mark.parametrize(
    ("array", "reason"),
    [
        (np.array(["a", "b"]), "a region is a mask"),
        (np.zeros((2, 4)), "a region is a mask"),
        (np.zeros((2, 2, 3)), "a region is a mask"),
        (np.array(5), "a region is a mask"),
        (np.zeros(3, dtype=[("x", "f8")]), "plain numbers"),
        (np.zeros(3, complex), "a region is a mask"),
    ],
)
def test_region_files_of_something_else_are_refused(tmp_path, array, reason):
    np.save(tmp_path / "a.npy", array)
    np.savez(tmp_path / "a.npz", seat=array)
    for name in ("a.npy", "a.npz"):
        with pytest.raises(RegionError, match=reason) as caught:
            read_region_file(tmp_path / name)
        assert name in str(caught.value)


def test_a_region_file_that_unpacks_to_gigabytes_is_refused(tmp_path):
    (tmp_path / "a.npz").write_bytes(bomb(["seat", "back"]))
    assert "unpack to more than" in message_of(lambda: read_region_file(tmp_path / "a.npz"))


def test_unpacking_what_is_damaged_is_no_error_of_zlib(tmp_path):
    content = bytearray(npz())
    place = content.index(b"points.npy") + 40
    content[place : place + 8] = b"\xff" * 8
    (tmp_path / "a.npz").write_bytes(content)
    assert "not plain NumPy" in message_of(lambda: read_cloud(tmp_path / "a.npz"))
