from __future__ import annotations

from dataclasses import replace

import pytest

from builders.export_checks import (
    HALF_TURN_ABOUT_X,
    compare,
    job_of,
    path_of,
    straight,
    written,
)
from builders.read_programs import (
    read_krl,
    read_lines,
    read_rapid,
)
from nrdf.export.options import Options
from nrdf.export.registry import export_job


def test_long_names_are_cut_to_what_a_controller_takes(tmp_path):
    job = job_of(*(path_of(straight("process", 0, 9), region="r" * 90) for _ in range(2)))
    job = replace(job, category="c" * 90, frame="f" * 90)
    export_job(job, ["krl", "rapid"], tmp_path)
    (source,) = (tmp_path / "krl").glob("*.src")
    (module,) = (tmp_path / "rapid").glob("*.mod")
    assert len(source.stem) == 24 and len(module.stem) == 28
    assert len(read_krl(source)) == len(read_rapid(module)) == 2


@pytest.mark.parametrize("tool_z", [None, "into", "out"])
def test_krl(wild, tmp_path, tool_z):
    paths = read_krl(written(wild, "krl", tmp_path, Options(tool_z=tool_z)))
    compare(wild, paths, turn=HALF_TURN_ABOUT_X if tool_z == "out" else None)


def test_robots_stop_where_contact_begins_and_ends(wild, tmp_path):
    lines = read_lines(written(wild, "krl", tmp_path), "\r\n")
    moves = [line for line in lines if "{" in line]
    stops = [i for i, line in enumerate(moves) if not line.endswith(" C_DIS")]
    assert stops == [0, 2, 27, 31, 56, 63, 64, 65, 73]
