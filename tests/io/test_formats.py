"""What sensors' files hold beside points: sensors, colours, intensity, gaps, compression."""

from __future__ import annotations

import builtins
import struct

import numpy as np
import pytest
import trimesh

from nrdf.errors import CloudError
from nrdf.io.cloud import PointCloud, read_cloud, write_cloud
from nrdf.io.formats.bag import MESSAGE
from nrdf.io.formats.pcd import decompress_lzf

POINTS = np.array([[0.0, 1.0, 2.0], [3.5, -4.0, 5.0], [0.25, 0.5, 1e-3], [7.0, 8.0, 9.0]])
COLOURS = np.arange(12, dtype=np.uint8).reshape(4, 3)


def pcd(data: bytes, kind: str, viewpoint: str = "", height: int = 1, count: int = 4) -> bytes:
    place = f"VIEWPOINT {viewpoint}\n" if viewpoint else ""
    size = f"WIDTH {count // height}\nHEIGHT {height}\n{place}POINTS {count}\n"
    return (
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z rgb intensity\nSIZE 4 4 4 4 4\nTYPE F F F U F\n"
        f"COUNT 1 1 1 1 1\n{size}DATA {kind}\n"
    ).encode() + data


ROWS = np.zeros(4, dtype=[("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgb", "<u4"), ("i", "<f4")])
for axis, name in enumerate("xyz"):
    ROWS[name] = POINTS[:, axis]
ROWS["rgb"] = COLOURS.astype(np.uint32) @ [1 << 16, 1 << 8, 1]
ROWS["i"] = [0.5, 1, 2, 3]
ASCII = "".join(f"{r['x']} {r['y']} {r['z']} {r['rgb']} {r['i']}\n" for r in ROWS).encode()


def literal_lzf(raw: bytes) -> bytes:
    pieces = (raw[i : i + 32] for i in range(0, len(raw), 32))
    return b"".join(bytes([len(piece) - 1]) + piece for piece in pieces)


def compressed() -> bytes:
    raw = b"".join(np.ascontiguousarray(ROWS[name]).tobytes() for name in ROWS.dtype.names)
    packed = literal_lzf(raw)
    return struct.pack("<II", len(packed), len(raw)) + packed


@pytest.mark.parametrize(
    ("kind", "data"),
    [("ascii", ASCII), ("binary", ROWS.tobytes()), ("binary_compressed", compressed())],
)
def test_pcd_gives_colours_intensity_and_the_sensor(tmp_path, kind, data):
    (tmp_path / "a.pcd").write_bytes(pcd(data, kind, "1 2 3 1 0 0 0"))
    cloud = read_cloud(tmp_path / "a.pcd")
    np.testing.assert_allclose(cloud.points, POINTS, rtol=1e-6)
    np.testing.assert_array_equal(cloud.colours, COLOURS)
    np.testing.assert_array_equal(cloud.intensity, ROWS["i"])
    np.testing.assert_array_equal(cloud.sensors, [[1, 2, 3]])


def test_a_viewpoint_at_the_origin_counts_in_grids_only(tmp_path):
    for height, known in ((1, False), (2, True)):
        (tmp_path / "a.pcd").write_bytes(pcd(ASCII, "ascii", "0 0 0 1 0 0 0", height))
        assert (read_cloud(tmp_path / "a.pcd").sensors is not None) == known


def test_pixels_that_measured_nothing_are_dropped_from_pcd(tmp_path, caplog):
    rows = ROWS.copy()
    rows["x"][1:] = np.nan
    (tmp_path / "a.pcd").write_bytes(pcd(rows.tobytes(), "binary"))
    with caplog.at_level("INFO"):
        cloud = read_cloud(tmp_path / "a.pcd")
    assert len(cloud) == len(cloud.colours) == len(cloud.intensity) == 1
    assert "dropped 3 points" in caplog.text
    rows["x"] = np.nan
    (tmp_path / "a.pcd").write_bytes(pcd(rows.tobytes(), "binary"))
    with pytest.raises(CloudError, match="none of its 4 points was measured"):
        read_cloud(tmp_path / "a.pcd")


def test_lzf_repeats_what_came_before_even_into_itself():
    # "abc" as it is, then 9 bytes from 3 back, then 20 from 1 back (a long length).
    packed = bytes([2]) + b"abc" + bytes([(7 << 5), 0, 2]) + bytes([7 << 5, 11, 0])
    assert decompress_lzf(packed, 32) == b"abc" * 4 + b"c" * 20
    for wrong, size, message in (
        (packed, 31, "give 32 of 31"),
        (packed[:-1], 32, "truncated within"),
        (bytes([1 << 5, 5]), 3, "what was not there"),
        (bytes([31]) + b"short", 32, "give 5 of 32"),
    ):
        with pytest.raises(ValueError, match=message):
            decompress_lzf(wrong, size)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.csv", "x,y,z,red,green,blue,intensity\n"),
        ("a.txt", "# X Y Z R G B Intensity\n"),
        ("a.xyz", "//x y z intensity r g b\n"),
    ],
)
def test_named_columns_of_text_are_followed(tmp_path, name, content):
    middle = [COLOURS, ROWS["i"][:, None]]
    table = np.hstack([POINTS, *(middle if name != "a.xyz" else middle[::-1])])
    delimiter = "," if name == "a.csv" else " "
    rows = "\n".join(delimiter.join(f"{v:.9g}" for v in row) for row in table)
    (tmp_path / name).write_text(content + rows)
    cloud = read_cloud(tmp_path / name)
    np.testing.assert_allclose(cloud.points, POINTS)
    np.testing.assert_array_equal(cloud.colours, COLOURS)
    np.testing.assert_array_equal(cloud.intensity, ROWS["i"])


def test_unnamed_columns_are_told_by_their_values(tmp_path):
    np.savetxt(tmp_path / "a.xyz", np.hstack([POINTS, COLOURS]))
    np.testing.assert_array_equal(read_cloud(tmp_path / "a.xyz").colours, COLOURS)
    np.savetxt(tmp_path / "b.xyz", np.hstack([POINTS, ROWS["i"][:, None]]))
    np.testing.assert_array_equal(read_cloud(tmp_path / "b.xyz").intensity, ROWS["i"])


def test_what_a_cloud_knows_comes_back_from_ply_and_npz(tmp_path):
    sensors = np.array([[1.5, 0.1 + 0.2, -3], [4, 5, 6e-9]])
    cloud = PointCloud(POINTS, None, "mm", "cell", COLOURS, ROWS["i"], sensors)
    write_cloud(tmp_path / "a.ply", cloud)
    known = {"colours": COLOURS, "intensity": ROWS["i"], "sensors": sensors}
    np.savez(tmp_path / "a.npz", points=POINTS, unit="mm", frame="cell", **known)
    for name in ("a.ply", "a.npz"):
        found = read_cloud(tmp_path / name)
        for key, value in known.items():
            np.testing.assert_allclose(getattr(found, key), value, rtol=1e-8)
        assert (found.unit, found.frame) == ("mm", "cell")
    part = cloud.select(np.array([2, 0]))
    np.testing.assert_array_equal(part.colours, COLOURS[[2, 0]])
    np.testing.assert_array_equal(part.sensors, sensors)


@pytest.mark.parametrize("words", ["1 2", "1 2 x", "1 2 nan"])
def test_a_damaged_sensor_comment_is_refused(tmp_path, words):
    write_cloud(tmp_path / "a.ply", PointCloud(POINTS, sensors=np.ones((1, 3))))
    content = (tmp_path / "a.ply").read_bytes()
    (tmp_path / "a.ply").write_bytes(content.replace(b"sensor 1 1 1", f"sensor {words}".encode()))
    with pytest.raises(CloudError, match="three numbers"):
        read_cloud(tmp_path / "a.ply")


def test_glb_is_a_mesh_or_points_in_metres(tmp_path):
    trimesh.creation.box((1.0, 0.4, 0.6)).export(tmp_path / "mesh.glb")
    cloud = read_cloud(tmp_path / "mesh.glb", mesh_samples=500)
    assert len(cloud) == 500 and cloud.unit == "m" and cloud.normals is not None
    trimesh.Scene(trimesh.PointCloud(POINTS)).export(tmp_path / "points.glb")
    np.testing.assert_allclose(read_cloud(tmp_path / "points.glb").points, POINTS, rtol=1e-6)
    content = (tmp_path / "mesh.glb").read_bytes()
    (tmp_path / "mesh.glb").write_bytes(content[:100])
    with pytest.raises(CloudError, match="truncated or damaged"):
        read_cloud(tmp_path / "mesh.glb")


@pytest.fixture
def bag(tmp_path):
    """Write bags of PointCloud2: topic to a list of (frame, points)."""
    pytest.importorskip("rosbags", reason="needs the extra: pip install 'nrdf[ros]'")
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kinds = store.types
    header, stamp = kinds["std_msgs/msg/Header"], kinds["builtin_interfaces/msg/Time"]
    message, field = kinds[MESSAGE], kinds["sensor_msgs/msg/PointField"]

    def one(frame, points, big=False):
        order = ">" if big else "<"
        layout = np.dtype(
            {"names": ["x", "y", "z", "intensity"], "formats": [f"{order}f4"] * 4,
             "offsets": [0, 4, 8, 16], "itemsize": 24}
        )  # fmt: skip
        rows = np.zeros(len(points), layout)
        for axis, name in enumerate("xyz"):
            rows[name] = points[:, axis]
        rows["intensity"] = np.arange(len(points))
        fields = [field(n, layout.fields[n][1], 7, 1) for n in layout.names]
        data = np.frombuffer(rows.tobytes(), np.uint8)
        return message(header(stamp(0, 0), frame), 1, len(rows), fields, big, 24,
                       24 * len(rows), data, False)  # fmt: skip

    def write(topics, mcap=False, name="bag"):
        plugin = StoragePlugin.MCAP if mcap else StoragePlugin.SQLITE3
        with Writer(tmp_path / name, version=9, storage_plugin=plugin) as writer:
            for topic, clouds in topics.items():
                connection = writer.add_connection(topic, MESSAGE, typestore=store)
                for number, cloud in enumerate(clouds):
                    raw = store.serialize_cdr(one(*cloud), MESSAGE)
                    writer.write(connection, number, raw)
        return tmp_path / name

    return write


@pytest.mark.parametrize("mcap", [False, True])
def test_a_bag_gives_its_first_cloud_with_points(bag, mcap, caplog):
    gaps = np.vstack([POINTS, np.full((6, 3), np.nan)])
    clouds = [("depth_optical_frame", gaps[4:]), ("depth_optical_frame", gaps, True)]
    folder = bag({"/points": clouds}, mcap)
    file = next(p for p in folder.iterdir() if p.suffix in (".mcap", ".db3"))
    for path in (folder, file):
        with caplog.at_level("INFO"):
            cloud = read_cloud(path)
        np.testing.assert_allclose(cloud.points, POINTS, rtol=1e-6)
        np.testing.assert_array_equal(cloud.intensity, range(4))
        assert (cloud.unit, cloud.frame) == ("m", "depth_optical_frame")
        np.testing.assert_array_equal(cloud.sensors, [[0, 0, 0]])
        assert "message 2 of 2 of /points" in caplog.text


def test_the_topic_of_a_bag_is_chosen(bag):
    path = bag({"/left": [("base_link", POINTS)], "/right": [("base_link", 2 * POINTS)]})
    with pytest.raises(CloudError, match=r"several topics have clouds.*/left, /right"):
        read_cloud(path)
    with pytest.raises(CloudError, match="no topic with clouds '/up'; known: /left, /right"):
        read_cloud(path, topic="/up")
    cloud = read_cloud(path, topic="/right")
    np.testing.assert_allclose(cloud.points, 2 * POINTS, rtol=1e-6)
    assert cloud.sensors is None


def test_bad_bags_are_refused(bag, tmp_path):
    with pytest.raises(CloudError, match="no topic of this bag is of"):
        read_cloud(bag({}, name="empty"))
    with pytest.raises(CloudError, match="holds a point"):
        read_cloud(bag({"/p": [("base", np.full((3, 3), np.nan))]}, name="blind"))
    broken = bag({"/p": [("base", POINTS)]}, True, "broken")
    file = next(broken.glob("*.mcap"))
    file.write_bytes(file.read_bytes()[:-200])
    with pytest.raises(CloudError, match="truncated or damaged"):
        read_cloud(file)
    (broken / "metadata.yaml").unlink()
    with pytest.raises(CloudError, match="ros2 bag reindex"):
        read_cloud(file)


def test_without_rosbags_the_extra_is_named(tmp_path, monkeypatch):
    (tmp_path / "metadata.yaml").write_text("")
    real = builtins.__import__

    def missing(name, *rest):
        if name.startswith("rosbags"):
            raise ImportError(name)
        return real(name, *rest)

    monkeypatch.setattr(builtins, "__import__", missing)
    with pytest.raises(CloudError, match=r"pip install 'nrdf\[ros\]'"):
        read_cloud(tmp_path)
