from __future__ import annotations

import pytest

from builders.export_jobs import wild_job
from builders.read_programs import (
    read_rapid,
    read_urscript,
)
from nrdf.errors import ProcessError
from nrdf.export.options import Options
from nrdf.export.registry import export_job
from nrdf.process.result_keys import FeedLimitKeys
from nrdf.process_model.feed_planner import FeedLimits


@pytest.mark.parametrize(
    "options, message",
    [
        ({"tool_number": 0}, r"--tool-number 0: must be from 1 to"),
        ({"frame_number": 33}, r"--frame-number 33: must be from 1 to 32"),
        ({"program_number": 10000}, r"--program-number 10000: must be from 1 to 9999"),
        ({"blend_mm": -1.0}, r"--blend-mm -1.0: must be from 0 to 100"),
        ({"blend_mm": float("nan")}, r"--blend-mm nan"),
        ({"acceleration_m_s2": 0.0}, r"--acceleration-m-s2 0.0"),
    ],
)
def test_numbers_out_of_range_are_named(options, message):
    with pytest.raises(ProcessError, match=message):
        Options(**options)


def test_names_of_frame_tool_and_program_may_be_chosen(tmp_path):
    options = Options(
        program="polish it", frame="fixture 2", tool="Spindle-A", frame_number=4, tool_number=7
    )
    export_job(wild_job(), ["rapid", "krl", "apt", "gcode", "csv"], tmp_path, options)
    text = (tmp_path / "rapid/polish_it.mod").read_text()
    assert "PROC polish_it()" in text and ",Spindle_A\\WObj:=fixture_2;" in text
    data = (tmp_path / "krl/polish_it.dat").read_text()
    assert "nrdf_base=4" in data and "nrdf_tool_7=7" in data and "nrdf_tool_8" not in data
    assert "LOADTL/7" in (tmp_path / "apt/polish_it.apt").read_text()
    assert "\nG57\n" in (tmp_path / "gcode/polish_it.nc").read_text()
    assert "Frame: fixture 2." in (tmp_path / "csv/polish_it.csv").read_text()


def test_process_only_leaves_approach_and_retract_out(tmp_path):
    options = Options(process_only=True)
    export_job(wild_job(), ["rapid", "urscript"], tmp_path, options)
    for paths in (
        read_rapid(tmp_path / "rapid/nrdf_chair.mod"),
        read_urscript(tmp_path / "urscript/nrdf_chair.script"),
    ):
        assert [len(path) for path in paths] == [57, 9]
        assert {read.kind for path in paths for read in path} == {"process"}
    # The tool is on the part already: no zero there.
    assert (
        "zero_ftsensor()"
        not in (tmp_path / "urscript/nrdf_chair.script").read_text().split("def p1")[1]
    )


def test_programs_accelerate_as_feeds_are_planned():
    planned = {FeedLimits().acceleration_m_s2, FeedLimitKeys().acceleration_m_s2}
    assert planned == {Options().acceleration_m_s2}
