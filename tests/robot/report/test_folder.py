from __future__ import annotations

import numpy as np
import pytest

from nrdf.robot.report.folder import write_simulation


def test_the_folder_of_a_simulation(plate, arm, tmp_path):
    report = write_simulation(tmp_path, plate, "plate", {}, pictures=False)
    assert report["total"]["reached_share"] == 1.0
    assert report["paths"][0]["position_error_m"] < 1e-4
    head, *rows = (tmp_path / "joints.csv").read_text().splitlines()
    assert head.split(",")[6:12] == list(arm.joint_names)
    joints = np.array([[float(x) for x in row.split(",")[6:12]] for row in rows])
    assert np.abs(np.diff(joints, axis=0)).max() < 0.15  # no jumps
    assert "servoj(" in (tmp_path / "joints.script").read_text()
    page = (tmp_path / "report.html").read_text()
    assert "plate" in page
    said = "the job does not say how its object lies: taken to have +Y up and +X ahead"
    assert report["placement"]["object_pose"] == said and said in page
    assert any(said in line for line in report["warnings"])
    coverage = report["paths"][0]["coverage"]
    shares = coverage["achieved"], *coverage["left_out"].values(), coverage["unreached"]
    assert sum(shares) == pytest.approx(1.0)
