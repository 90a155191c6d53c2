from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nrdf.errors import RobotError
from nrdf.robot.planning.timing import STEP_S
from nrdf.robot.report.trajectories import EVERY, write_bag, write_csv, write_script, written_steps


def test_every_tenth_step_and_the_last_are_written(plate):
    log = plate.paths[0].logs[1]
    steps = written_steps(log)
    assert steps[0] == 0 and steps[-1] == len(log.joints) - 1
    assert (np.diff(steps)[:-1] == EVERY).all()


def test_times_go_on_from_action_to_action(plate, tmp_path):
    write_csv(tmp_path, plate)
    head, *rows = (tmp_path / "joints.csv").read_text().splitlines()
    assert head.startswith("time_s,region,process,action,line,turntable_rad,")
    rows = [row.split(",") for row in rows]
    times = [float(row[0]) for row in rows]
    assert (np.diff(times) > 0.0).all()
    total = sum(len(log.joints) for log in plate.paths[0].logs) * STEP_S
    assert times[-1] == pytest.approx(total - STEP_S, abs=1e-3)
    assert {row[4] for row in rows if row[3] == "process"} == {"0", "1", "2"}
    assert {row[4] for row in rows if row[3] == "transition"} == {""}


def test_a_bag_has_a_trajectory_for_each_action(plate, tmp_path):
    rosbag2 = pytest.importorskip("rosbags.rosbag2", reason="pip install 'nrdf[ros]'")
    assert write_bag(tmp_path, plate)
    with rosbag2.Reader(tmp_path / "joints.bag") as reader:
        topics = [connection.topic for connection, _, _ in reader.messages()]
    assert topics == ["/nrdf/p1_top/joint_trajectory"] * len(plate.paths[0].logs)


def test_urscript_is_for_arms_of_six_axes(plate, tmp_path):
    write_script(tmp_path, plate)
    lines = (tmp_path / "joints.script").read_text().splitlines()
    assert lines[-1] == "end" and '  popup("Mount: disc", title="nrdf", blocking=True)' in lines
    assert sum("servoj(" in line for line in lines) > 100
    seven = replace(plate.arm, joint_names=(*plate.arm.joint_names, "seventh"))
    with pytest.raises(RobotError, match="URScript is for arms of six axes"):
        write_script(tmp_path, replace(plate, arm=seven))
