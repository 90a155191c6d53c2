from __future__ import annotations

import csv

import numpy as np
from scipy.spatial.transform import Rotation

from builders.export_checks import (
    compare,
    with_first_feed_unknown,
    written,
)
from builders.read_programs import (
    Read,
    read_lines,
)


def test_csv(wild, tmp_path):
    rows = read_lines(written(wild, "csv", tmp_path))
    rows = list(csv.DictReader(row for row in rows if not row.startswith("#")))
    paths: dict[str, list[Read]] = {}
    for row in rows:
        pose = [float(row[key]) for key in ["x_m", "y_m", "z_m", "qx", "qy", "qz", "qw"]]
        matrix = Rotation.from_quat(pose[3:]).as_matrix()
        force = float(row["force_n"]) if row["force_n"] else None
        feed, dwell = float(row["feed_m_s"]), float(row["dwell_s"])
        read = Read(row["kind"], np.array(pose[:3]), matrix, feed, force, dwell)
        paths.setdefault(row["path"], []).append(read)
    compare(wild, with_first_feed_unknown(list(paths.values())), force=True)
    assert {row["region"] for row in rows} == {"seat_ left _old_", "Rucken_ _x"}
    assert {row["spindle_rad_s"] for row in rows} == {"314.0", ""}
