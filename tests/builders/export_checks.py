"""What the tests of the exports share: short jobs, and what was read back against the job."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from builders.read_programs import (
    Read,
)
from nrdf.export.options import Options
from nrdf.export.prepare import blended_segments
from nrdf.export.registry import export_job
from nrdf.toolpath.types import Job, Segment, ToolPath

POSITION_M, TURN_RAD = 1e-7, 2e-7
HALF_TURN_ABOUT_X = np.diag([1.0, -1.0, -1.0])
DOWN = np.array([1.0, 0.0, 0.0, 0.0])


def written(job: Job, name: str, folder: Path, options: Options | None = None) -> Path:
    """The file, not the .dat beside a .src, that a format makes of `job`."""
    (files,) = export_job(job, [name], folder, options).values()
    return folder / next(file for file in files if not file.endswith(".dat"))


def angle_between(a, b):
    """Angle of vectors (3,), or of rotations (3, 3): sine and cosine, exact for small ones."""
    if np.ndim(a) == 1:
        return np.arctan2(np.linalg.norm(np.cross(a, b)), np.dot(a, b))
    return Rotation.from_matrix(np.asarray(a).T @ b).magnitude()


def compare(job, paths: list[list[Read]], force=False, dwell=True, turn=None, within=POSITION_M):
    """What was read against `job`: poses, kinds, feeds on lines, and force where it is carried."""
    assert len(paths) == len(job.paths)
    for path, reads in zip(job.paths, paths, strict=True):
        rows = [(segment, n) for segment in path.segments for n in range(len(segment.positions))]
        assert len(rows) == len(reads)
        for i, ((segment, n), read) in enumerate(zip(rows, reads, strict=True)):
            assert np.linalg.norm(read.position - segment.positions[n]) <= within
            expected = Rotation.from_quat(segment.quaternions_xyzw[n]).as_matrix()
            expected = expected if turn is None else expected @ turn
            expected = -expected[:, 2] if read.orientation.ndim == 1 else expected
            assert angle_between(expected, read.orientation) <= TURN_RAD
            assert read.kind == segment.kind
            assert (read.feed_m_s is None) == (i == 0)
            if read.feed_m_s is not None:
                assert read.feed_m_s == pytest.approx(segment.speeds_m_s[n], rel=1e-3)
            if force:
                assert read.force_n == segment.force_n
            last = n == len(segment.positions) - 1
            if dwell:
                assert read.dwell_s == pytest.approx(segment.dwell_s if last else 0.0)


def with_first_feed_unknown(paths: list[list[Read]]) -> list[list[Read]]:
    """Formats that are no programs give every waypoint a feed."""
    return [[replace(path[0], feed_m_s=None), *path[1:]] for path in paths]


def read_bag(folder: Path):
    """Messages of a bag as (topic, nanoseconds, message)."""
    reader_module = pytest.importorskip("rosbags.rosbag2", reason="pip install 'nrdf[ros]'")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    with reader_module.Reader(folder) as reader:
        return [
            (connection.topic, time, store.deserialize_cdr(data, connection.msgtype))
            for connection, time, data in reader.messages()
        ]


def straight(kind, *x_mm, force=None, dwell=0.0):
    """A segment along x with the tool straight down."""
    positions = np.array([[x / 1000, 0.0, 0.0] for x in x_mm])
    turned = np.tile(DOWN, (len(x_mm), 1))
    return Segment(kind, 0, positions, turned, 0.1, force, dwell)


def path_of(*segments, tool="disc", region="seat"):
    return ToolPath(region, "sand", tool, 0.025, segments)


def job_of(*paths):
    return Job("chair", "cell", paths)


def blends_mm(*segments, blend_mm=5.0):
    return [
        np.round(1000 * s.blends_m, 6).tolist()
        for s in blended_segments(path_of(*segments), blend_mm / 1e3)
    ]
