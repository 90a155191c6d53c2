from __future__ import annotations

import json
import sys

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from builders.export_checks import (
    compare,
    read_bag,
    with_first_feed_unknown,
)
from builders.export_jobs import small_job
from builders.read_programs import (
    Read,
)
from nrdf.errors import ProcessError
from nrdf.export.registry import export_job


def test_ros2_bag(wild, tmp_path):
    pytest.importorskip("rosbags.rosbag2", reason="pip install 'nrdf[ros]'")
    export_job(wild, ["ros2-bag"], tmp_path)
    messages = read_bag(tmp_path / "ros2-bag" / "bag")
    assert messages[0][0] == "/nrdf/job"
    about = json.loads(messages[0][2].data)
    assert any("force" in line and "not carried" in line for line in about["conventions"])
    assert about["paths"][0]["segments"][1]["force_n"] == 12.5
    segments = [(path, s) for path in wild.paths for s in path.segments]
    topics = ("/nrdf/p1_seat_left_old/", "/nrdf/p2_Rucken_x/")
    for ending in ("path", "poses"):
        found = [m for m in messages if m[0].endswith(f"/{ending}")]
        reads: dict[str, list[Read]] = {}
        assert len(found) == len(segments)
        for (topic, time, message), (_, segment) in zip(found, segments, strict=True):
            assert topic.startswith(topics) and message.header.frame_id == "cell_A"
            kind = topic.split("/")[3]
            poses = [getattr(p, "pose", p) for p in message.poses]
            if ending == "path":
                stamps = [p.header.stamp for p in message.poses]
                seconds = np.array([stamp.sec + 1e-9 * stamp.nanosec for stamp in stamps])
                assert seconds[0] == pytest.approx(1e-9 * time, abs=2e-9)
                ways = np.linalg.norm(np.diff(segment.positions, axis=0), axis=1)
                feeds = segment.speeds_m_s[1:]
                np.testing.assert_allclose(np.diff(seconds) * feeds, ways, atol=1e-8)
            for p, feed in zip(poses, segment.speeds_m_s, strict=True):
                q = [getattr(p.orientation, key) for key in "xyzw"]
                at = np.array([getattr(p.position, key) for key in "xyz"])
                read = Read(kind, at, Rotation.from_quat(q).as_matrix(), feed)
                reads.setdefault(topic.split("/")[2], []).append(read)
        compare(wild, with_first_feed_unknown(list(reads.values())), dwell=False)


def test_missing_rosbags_names_the_extra(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "rosbags.rosbag2", None)
    with pytest.raises(ProcessError, match=r"needs the package rosbags: pip install 'nrdf\[ros\]'"):
        export_job(small_job(), ["ros2-bag"], tmp_path)
