"""Clouds of ROS 2 bags."""

from __future__ import annotations

import builtins

import numpy as np
import pytest

from builders.cloud_files import POINTS
from nrdf.errors import CloudError
from nrdf.io.cloud import read_cloud
from nrdf.io.formats.bag import MESSAGE


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
