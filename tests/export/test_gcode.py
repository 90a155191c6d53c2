from __future__ import annotations

import pytest

from builders.export_checks import (
    POSITION_M,
    compare,
    written,
)
from builders.export_jobs import small_job
from builders.read_programs import (
    read_gcode,
    read_lines,
)
from nrdf.errors import ProcessError
from nrdf.export.options import Options
from nrdf.export.registry import export_job


@pytest.mark.parametrize("rotary", ["AC", "BC"])
@pytest.mark.parametrize("tilt", ["positive", "negative"])
@pytest.mark.parametrize("without", [False, True])
def test_gcode(wild, tmp_path, rotary, tilt, without):
    options = Options(rotary=rotary, tilt=tilt, without_tcp_control=without, frame_number=3)
    path = written(wild, "gcode", tmp_path, options)
    # On the tables, the rounding of an angle moves a point that is metres away.
    within = 1e-6 if without else POSITION_M
    compare(wild, read_gcode(path, rotary, not without), within=within)
    assert "G56" in read_lines(path)


def test_gcode_has_six_work_offsets(tmp_path):
    with pytest.raises(ProcessError, match="--frame-number 7: gcode has 1 to 6"):
        export_job(small_job(), ["gcode"], tmp_path, Options(frame_number=7))
