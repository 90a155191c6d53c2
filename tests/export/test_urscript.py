from __future__ import annotations

from dataclasses import replace

import numpy as np

from builders.export_checks import (
    HALF_TURN_ABOUT_X,
    compare,
    job_of,
    path_of,
    straight,
    written,
)
from builders.read_programs import (
    read_urscript,
)
from nrdf.export.options import Options
from nrdf.export.registry import FORMATS, export_job


def test_urscript_presses_exactly_where_the_job_does(wild, tmp_path):
    path = written(wild, "urscript", tmp_path)
    compare(wild, read_urscript(path), force=True)
    text = path.read_text()
    assert text.count("end_force_mode()") == 3
    assert text.index("zero_ftsensor()") < text.index("run nrdf_press()")


def test_urscript_pushes_the_other_way_when_tool_z_points_out(wild, tmp_path):
    paths = read_urscript(written(wild, "urscript", tmp_path, Options(tool_z="out")))
    compare(wild, paths, turn=HALF_TURN_ABOUT_X)
    assert {read.force_n for read in paths[0]} == {None, -12.5, -20.0}


def test_a_touch_without_a_move_still_presses_and_waits(tmp_path):
    touch = straight("process", 100, force=7.0, dwell=2.0)
    job = job_of(path_of(straight("approach", 0, 100), touch, straight("retract", 100, 0)))
    for name in FORMATS:
        if name != "ros2-bag":
            export_job(job, [name], tmp_path)
    text = (tmp_path / "urscript" / "nrdf_chair.script").read_text()
    order = ["nrdf_force_n = 7.000", "run nrdf_press()", "sleep(2.000)", "kill", "end_force_mode"]
    places = [text.rindex(part) for part in order]
    assert places == sorted(places)
    for kind, wait in (
        ("rapid/nrdf_chair.mod", "WaitTime 2.0"),
        ("krl/nrdf_chair.src", "WAIT SEC"),
    ):
        assert wait in (tmp_path / kind).read_text()


def test_force_ends_where_a_stroke_runs_off_the_part_and_begins_again_where_it_is_back(tmp_path):
    over = np.array([True, True, False, False, True, True])
    stroke = replace(straight("process", 0, 10, 20, 30, 40, 50, force=7.0), on_surface=over)
    job = job_of(path_of(straight("approach", -20, 0), stroke, straight("retract", 50, 90)))
    (reads,) = read_urscript(written(job, "urscript", tmp_path))
    pressed = [round(1000 * read.position[0]) for read in reads if read.force_n is not None]
    assert pressed == [10, 50]
    assert "process off the surface" in written(job, "urscript", tmp_path / "b").read_text()
