from __future__ import annotations

from dataclasses import replace

import pytest

from builders.export_checks import (
    blends_mm,
    job_of,
    path_of,
    straight,
)
from builders.read_programs import (
    read_lines,
    read_urscript,
)
from nrdf.errors import ProcessError
from nrdf.export.options import Options
from nrdf.export.prepare import blended_segments
from nrdf.export.registry import FORMATS, export_job


def test_waypoints_are_rounded_by_what_their_neighbours_leave():
    assert blends_mm(straight("process", 0, 10, 30, 70, 70.1, 80)) == [
        [0, 4.5, 5, 0, 0, 0]  # 0.45 of 0.1 mm is not worth rounding
    ]
    assert blends_mm(straight("process", 0, 10, 20), blend_mm=0.0) == [[0, 0, 0]]


def test_segments_are_joined_smoothly_unless_something_happens_between_them():
    free, more = straight("approach", 0, 100), straight("process", 200, 300)
    assert blends_mm(free, more) == [[0, 5], [5, 0]]
    assert blends_mm(replace(free, dwell_s=1.0), more) == [[0, 0], [5, 0]]
    assert blends_mm(free, replace(more, force_n=5.0)) == [[0, 0], [5, 0]]
    assert blends_mm(free, straight("process", 100, dwell=1.0), more) == [[0, 0], [], [5, 0]]
    both = replace(free, force_n=5.0), replace(more, force_n=5.0)
    assert blends_mm(*both) == [[0, 5], [5, 0]]


def test_waypoints_that_repeat_the_one_before_are_left_out():
    first, second = straight("approach", 0, 100), straight("process", 100, 100, 200)
    second.quaternions_xyzw[0] *= -1  # the same orientation
    second.quaternions_xyzw[1:] = [0.0, 1.0, 0.0, 0.0]  # another one
    driven = blended_segments(path_of(first, second), 0.005)
    assert [1000 * s.segment.positions[:, 0] for s in driven][1].tolist() == [100, 200]
    assert driven[1].segment.quaternions_xyzw.tolist() == [[0, 1, 0, 0]] * 2
    only = blended_segments(path_of(first, straight("process", 100, force=3.0)), 0.005)
    assert [len(s.segment.positions) for s in only] == [2, 0]


def test_each_tool_has_a_number(tmp_path):
    job = job_of(*(path_of(straight("process", 0, 9), tool=t) for t in ("a", "b", "a")))
    export_job(job, ["apt", "gcode"], tmp_path, Options(tool_number=3))
    lines = read_lines(tmp_path / "apt/nrdf_chair.apt")
    assert [line for line in lines if line.startswith("LOADTL")] == [
        "LOADTL/3",
        "LOADTL/4",
        "LOADTL/3",
    ]
    assert (tmp_path / "gcode/nrdf_chair.nc").read_text().count(" M6\n") == 3
    export_job(job, ["urscript"], tmp_path)
    path = tmp_path / "urscript/nrdf_chair.script"
    assert [w for line in read_lines(path) for w in line.split() if w.startswith("popup(")] == [
        'popup("b:',
        'popup("a:',
    ]
    assert len(read_urscript(path)) == 3


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize(
    "job, message",
    [
        (job_of(), "no tool paths: no region was found"),
        (job_of(path_of()), "have no waypoints"),
        (job_of(path_of(straight("process", 900_000))), "region 'seat' .* 900 m.*must be metres"),
    ],
)
def test_a_job_with_nothing_to_drive_or_in_another_unit_is_refused(tmp_path, name, job, message):
    pytest.importorskip("rosbags.rosbag2") if name == "ros2-bag" else None
    with pytest.raises(ProcessError, match=message):
        export_job(job, [name], tmp_path)
