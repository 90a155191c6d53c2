from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from builders.export_checks import (
    compare,
    with_first_feed_unknown,
    written,
)
from builders.export_jobs import small_job
from builders.read_programs import (
    Read,
)


def test_json(wild, tmp_path):
    content = json.loads(written(wild, "json", tmp_path).read_bytes())
    assert content["waypoint"] == ["x_m", "y_m", "z_m", "qx", "qy", "qz", "qw"]
    paths = []
    for path in content["paths"]:
        reads = []
        for segment in path["segments"]:
            feeds = segment.get("feeds_m_s") or [segment["feed_m_s"]] * len(segment["waypoints"])
            for pose, feed in zip(segment["waypoints"], feeds, strict=True):
                turn = Rotation.from_quat(pose[3:]).as_matrix()
                known = segment["kind"], np.array(pose[:3]), turn
                reads.append(Read(*known, feed, segment["force_n"]))
            reads[-1].dwell_s = segment["dwell_s"]
        paths.append(reads)
    compare(wild, with_first_feed_unknown(paths), force=True)
    assert [p["region"] for p in content["paths"]] == ["seat, left (old)", "Rücken; %x"]
    assert content["paths"][0]["parameters"] == {"grit": 120}


def test_json_keeps_parameters_as_they_are(tmp_path):
    job = small_job()
    given = {"note": "[ 1,   2 ]", "list": [1, "a,   b", [2.5, 3]], "none": []}
    job = replace(job, paths=(replace(job.paths[0], parameters=given),))
    content = json.loads(written(job, "json", tmp_path).read_bytes())
    assert content["paths"][0]["parameters"] == given
