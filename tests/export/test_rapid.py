from __future__ import annotations

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
    read_lines,
    read_rapid,
)
from nrdf.errors import ProcessError
from nrdf.export.options import Options
from nrdf.export.registry import export_job


def test_tools_that_rapid_cannot_tell_apart_are_refused(tmp_path):
    job = job_of(*(path_of(straight("process", 0, 9), tool=t) for t in ("disc-1", "Disc 1")))
    with pytest.raises(ProcessError, match="'disc-1' and 'Disc 1' would both be called Disc_1"):
        export_job(job, ["rapid"], tmp_path)


@pytest.mark.parametrize("tool_z", [None, "into", "out"])
def test_rapid(wild, tmp_path, tool_z):
    paths = read_rapid(written(wild, "rapid", tmp_path, Options(tool_z=tool_z)))
    compare(wild, paths, turn=HALF_TURN_ABOUT_X if tool_z == "out" else None)


def test_robots_stop_where_contact_begins_and_ends(wild, tmp_path):
    lines = read_lines(written(wild, "rapid", tmp_path), "\r\n")
    moves = [line for line in lines if "Move" in line]
    stops = [i for i, line in enumerate(moves) if ",fine," in line]
    assert stops == [0, 2, 27, 31, 56, 63, 64, 65, 73]
