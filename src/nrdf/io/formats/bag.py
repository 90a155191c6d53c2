"""`sensor_msgs/PointCloud2` from a ROS 2 bag: a folder with metadata.yaml, or a file in one."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import numpy as np

from nrdf.errors import CloudError, unknown_name
from nrdf.io.files import read_file, require_file
from nrdf.io.formats.raw import RawCloud, colours_of, intensity_of, stack
from nrdf.io.rows import MAX_POINTS

logger = logging.getLogger(__name__)

_LONGEST_DESCRIPTION = 4_000_000  # bytes
MESSAGE = "sensor_msgs/msg/PointCloud2"
_KINDS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
_SENSOR_WORDS = ("optical", "camera", "lidar", "laser", "depth", "sensor", "scanner")


def read_bag(path: Path, _: int, topic: str | None = None) -> RawCloud:
    """The first cloud that holds points, of the only topic that has clouds or of `topic`.

    The unit is the metre (ROS REP 103). Where the message's frame is that of a sensor by its name
    ("camera_depth_optical_frame"), the sensor stands at its origin. Raises CloudError if rosbags is
    not installed, the bag is damaged or holds no cloud, or `topic` is needed or not there.
    """
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise CloudError(
            f"{path} is a ROS 2 bag, and reading it needs rosbags: pip install 'nrdf[ros]'"
        ) from None
    folder = path if path.is_dir() else path.parent
    if not (folder / "metadata.yaml").is_file():
        raise CloudError(
            f"{path}: a bag's file without its metadata.yaml beside it; copy the bag's whole "
            f"folder, or make that file anew: ros2 bag reindex {folder}"
        )
    _check_folder(folder)
    try:
        with AnyReader([folder], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            clouds = [c for c in reader.connections if c.msgtype == MESSAGE]
            chosen = _choose(path, sorted({c.topic for c in clouds}), topic)
            wanted = [c for c in clouds if c.topic == chosen]
            for number, (connection, _time, raw) in enumerate(reader.messages(wanted), 1):
                cloud = from_message(reader.deserialize(raw, connection.msgtype))
                if np.isfinite(cloud.points).any():
                    count = sum(c.msgcount for c in wanted)
                    logger.info("%s: message %d of %d of %s", path, number, count, chosen)
                    return cloud
    except CloudError:
        raise
    except Exception as error:  # rosbags lets through what its storage and parsers raise
        why = str(error) or type(error).__name__
        raise CloudError(f"{path}: truncated or damaged ROS 2 bag ({why})") from error
    raise CloudError(f"{path}: no message of {chosen} holds a point")


def _check_folder(folder: Path) -> None:
    """Raise CloudError if reading the bag would wait for a pipe, or its description explodes."""
    description = read_file(folder / "metadata.yaml", CloudError, _LONGEST_DESCRIPTION)
    if b"<<" in description:  # merged mappings, which no bag has, can grow beyond all bounds
        raise CloudError(f"{folder / 'metadata.yaml'}: damaged: no bag's description merges keys")
    for file in folder.iterdir():
        if not file.is_dir():
            require_file(file, CloudError)


def _choose(path: Path, topics: list[str], topic: str | None) -> str:
    if not topics:
        raise CloudError(f"{path}: no topic of this bag is of {MESSAGE}")
    if topic is None and len(topics) > 1:
        raise CloudError(
            f"{path}: several topics have clouds; name one of them by --topic: {', '.join(topics)}"
        )
    if topic is not None and topic not in topics:
        raise CloudError(f"{path}: {unknown_name('topic with clouds', topic, topics)}")
    return topic or topics[0]


def from_message(message: Any) -> RawCloud:
    """The cloud of one PointCloud2. Raises ValueError if its sizes contradict each other."""
    step, width, height = int(message.point_step), int(message.width), int(message.height)
    order = ">" if message.is_bigendian else "<"
    names, formats, offsets = [], [], []
    for field in message.fields:
        kind = np.dtype(order + _KINDS[int(field.datatype)])
        if not 0 <= field.offset <= step - kind.itemsize:
            raise ValueError(f"field {field.name} does not fit into {step} bytes a point")
        names.append(str(field.name))
        formats.append(kind)
        offsets.append(int(field.offset))
    if not 0 <= width * height <= MAX_POINTS or message.row_step < width * step:
        raise ValueError(f"{height} rows of {width} points of {step} bytes")
    data = np.asarray(message.data, np.uint8)
    if len(data) < height * message.row_step:
        raise ValueError(f"{len(data)} bytes for {height} rows of {message.row_step}")
    rows = data[: height * message.row_step].reshape(height, message.row_step)
    packed = np.ascontiguousarray(rows[:, : width * step]).reshape(-1)
    layout = {"names": names, "formats": formats, "offsets": offsets, "itemsize": step}
    table = packed.view(np.dtype(layout))  # type: ignore[call-overload]
    columns = {name: table[name] for name in names}
    points = stack(columns, "xyz")
    if points is None:
        raise ValueError(f"fields x, y and z are needed; it has {', '.join(names)}")
    frame = str(message.header.frame_id) or None
    at_sensor = frame is not None and any(word in frame.lower() for word in _SENSOR_WORDS)
    return RawCloud(
        points,
        stack(columns, ("normal_x", "normal_y", "normal_z")),
        unit="m",
        frame=frame,
        colours=colours_of(columns),
        intensity=intensity_of(columns),
        sensors=np.zeros((int(at_sensor), 3)),
        gaps=True,
    )
