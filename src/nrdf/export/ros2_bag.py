"""A ROS 2 bag: a nav_msgs/Path and a geometry_msgs/PoseArray for each segment.

The poses' stamps are the times, from 0, at which the tool gets there at the segments' speeds.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from nrdf.errors import ProcessError
from nrdf.export.json_file import describe
from nrdf.export.names import identifier, plain_text
from nrdf.export.options import Options
from nrdf.export.prepare import prepare
from nrdf.io.atomic import output_errors
from nrdf.toolpath.types import Job, Segment

BAG = "bag"
_TYPES = {"path": "nav_msgs/msg/Path", "poses": "geometry_msgs/msg/PoseArray"}
_NOTES = (
    "Contact force, feed, spindle and dwell are not carried by Path and PoseArray: they are here, "
    "on this topic. Stamps count the time from the start at the given feeds."
)


def write(job: Job, options: Options, folder: Path) -> None:
    """Write the folder `bag`. Raises ProcessError where rosbags is not installed, and
    OutputError where the folder cannot be written."""
    try:
        from rosbags.rosbag2 import Writer
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise ProcessError(
            "the format ros2-bag needs the package rosbags: pip install 'nrdf[ros]'"
        ) from None
    job = prepare(job, options, "into")
    store = get_typestore(Stores.ROS2_HUMBLE)
    frame = plain_text(job.frame).replace(" ", "_")
    with output_errors(folder / BAG), Writer(folder / BAG, version=8) as writer:

        def send(topic: str, kind: str, message: Any, nanoseconds: int) -> None:
            known = (c for c in writer.connections if c.topic == topic)
            connection = next(known, None) or writer.add_connection(topic, kind, typestore=store)
            writer.write(connection, nanoseconds, store.serialize_cdr(message, kind))

        about = describe(job, options, waypoints=False)
        about["conventions"].append(_NOTES)
        text = json.dumps(about, indent=1, allow_nan=False)
        send("/nrdf/job", "std_msgs/msg/String", store.types["std_msgs/msg/String"](text), 0)
        clock, last = 0.0, None
        for i, path in enumerate(job.paths, start=1):
            prefix = f"/nrdf/{identifier(f'p{i} {path.region}', 48)}"
            for segment in path.segments:
                times = clock + _seconds(segment, last)
                for ending, message in _messages(store.types, segment, times, frame).items():
                    topic = f"{prefix}/{segment.kind}/{ending}"
                    send(topic, _TYPES[ending], message, _nanoseconds(times[0]))
                clock, last = times[-1] + segment.dwell_s, segment.positions[-1]


def _seconds(segment: Segment, last: np.ndarray | None) -> np.ndarray:
    """Time (n,) to each waypoint from the end `last` (3,) of what was driven before."""
    start = segment.positions[0] if last is None else last
    steps = np.diff(segment.positions, axis=0, prepend=start[None])
    return np.cumsum(np.linalg.norm(steps, axis=1) / segment.speeds_m_s)


def _nanoseconds(seconds: float) -> int:
    return round(seconds * 1e9)


def _messages(types: Any, segment: Segment, times: np.ndarray, frame: str) -> dict[str, Any]:
    """The segment as a message of each type."""

    def stamped(seconds: float) -> Any:
        whole, rest = divmod(_nanoseconds(seconds), 1_000_000_000)
        stamp = types["builtin_interfaces/msg/Time"](whole, rest)
        return types["std_msgs/msg/Header"](stamp, frame)

    poses = [
        types["geometry_msgs/msg/Pose"](
            types["geometry_msgs/msg/Point"](*position.tolist()),
            types["geometry_msgs/msg/Quaternion"](*quaternion.tolist()),
        )
        for position, quaternion in zip(segment.positions, segment.quaternions_xyzw, strict=True)
    ]
    stamps = [
        types["geometry_msgs/msg/PoseStamped"](stamped(float(t)), pose)
        for t, pose in zip(times, poses, strict=True)
    ]
    # Stamp 0 is "now" to tf, so the paths show in RViz whenever they are played.
    whole = stamped(0.0)
    return {
        "path": types[_TYPES["path"]](whole, stamps),
        "poses": types[_TYPES["poses"]](whole, poses),
    }
