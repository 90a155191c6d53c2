"""What programs switch, where, and in each language."""

from __future__ import annotations

import shutil
from dataclasses import replace

import numpy as np
import pytest

from builders.cells import cell_of
from builders.export_jobs import small_job
from nrdf.cell.placement import place_job
from nrdf.errors import ProcessError
from nrdf.export.options import Options, options_of_cell
from nrdf.export.registry import export_job
from nrdf.toolpath.types import Segment


def written(tmp_path, name, job=None, **changes):
    cell = cell_of(**changes)
    placed = place_job(cell, job or small_job(), tmp_path)
    shutil.rmtree(tmp_path / name, ignore_errors=True)
    export_job(placed, [name], tmp_path, options_of_cell(cell))
    files = sorted((tmp_path / name).iterdir())
    return [line.strip() for line in files[-1].read_text().splitlines()]


def test_a_spindle_turns_from_a_paths_first_waypoint_to_its_last(tmp_path):
    for name, on, wait, off, move in (
        ("urscript", "set_standard_digital_out(3, True)", "sleep(1.500)",
         "set_standard_digital_out(3, False)", "mov"),
        ("rapid", "SetDO doSpindle,1;", "WaitTime 1.500;", "SetDO doSpindle,0;", "Move"),
        ("krl", "$OUT[17]=TRUE", "WAIT SEC 1.500", "$OUT[17]=FALSE", "LIN"),
        ("gcode", "S3819.7 M3", "G4 X1.500", "M5", "G"),
        ("apt", "INSERT/SPIN 3819.7", "DELAY/1.500", "INSERT/STOP", "GOTO"),
    ):  # fmt: skip
        lines = written(tmp_path, name)
        first, last = lines.index(on), lines.index(off)
        assert lines.count(on) == 1 and lines[first + 1] == wait
        between = [line for line in lines[first:last] if line.startswith(move)]
        assert len(between) >= 5, name
        head = " ".join(lines)
        assert "by the program: disc 125." in head.replace("\n", " ") or "DISC 125" in head.upper()


def test_a_program_for_a_cell_is_in_the_base_with_the_cells_tools(tmp_path):
    script = "\n".join(written(tmp_path, "urscript"))
    assert "set_tcp(p[0.0000000, 0.0000000, 0.1800000" in script
    assert "set_target_payload(1.4000, [0.00000, 0.00000, 0.00000])" in script
    assert "Frame: base." in script and "nrdf_frame, the pose" not in script
    rapid = "\n".join(written(tmp_path, "rapid"))
    assert "tSander\\WObj:=wobj0" in rapid and "camera\\WObj:=wobj0" in rapid
    krl = "\n".join(written(tmp_path, "krl"))
    assert krl.count("BAS(#TOOL") == 2
    data = (tmp_path / "krl" / "nrdf_plate.dat").read_text()
    assert "nrdf_base=0" in data and "nrdf_tool_1=1" in data and "nrdf_tool_7=7" in data


def painted(**segment):
    job = small_job()
    first = job.paths[0]
    segments = tuple(replace(s, **segment) if s.kind == "process" else s for s in first.segments)
    path = replace(first, tool="gun", process_kind="paint", segments=segments)
    return replace(job, paths=(path,))


def test_a_gun_sprays_on_lines_alone_and_for_its_kind_alone(tmp_path):
    lines = written(tmp_path, "urscript", painted(force_n=None))
    on, off = (lines.index(f"set_standard_digital_out(2, {s})") for s in ("True", "False"))
    assert sum(line.startswith("movel") for line in lines[on:off]) == 3
    # It stops where it begins and ends to spray.
    before = [line for line in lines[:on] if line.startswith("movel")][-1]
    assert before.endswith("r=0.00000)")
    other = replace(painted(force_n=None).paths[0], process_kind="clean")
    lines = written(tmp_path, "urscript", replace(small_job(), paths=(other,)))
    assert "set_standard_digital_out(2, True)" not in lines


def test_an_add_on_for_force_is_told_the_force(tmp_path):
    lines = written(tmp_path, "krl", painted(force_n=12.0))
    on, off = lines.index("FORCE_ON(12.000)"), lines.index("FORCE_OFF()")
    assert sum(line.startswith("LIN") for line in lines[on:off]) == 3


def test_rapid_presses_with_force_control_where_the_cell_has_it(tmp_path):
    lines = written(tmp_path, "rapid", robot={"force_control": {"rapid": "fc-pressure"}})
    words = [line.split(" ")[0] for line in lines if line.startswith(("Move", "FC"))]
    assert words == [
        "MoveJ", "MoveL", "FCPress1LStart", "FCPressL", "FCPressL", "FCPressEnd", "MoveJ", "MoveL",
    ]  # fmt: skip
    assert any("\\Fz:=15.000,50,\\ForceFrameRef:=FC_REFFRAME_TOOL" in line for line in lines)
    with pytest.raises(ProcessError, match="no move away"):
        written(
            tmp_path, "rapid", robot={"force_control": {"rapid": "fc-pressure"}},
            programs={"options": {"process_only": True}},
        )  # fmt: skip


def test_options_of_a_cell_are_checked_and_the_command_line_comes_first():
    cell = cell_of(programs={"options": {"blend_mm": 3, "rotary": "BC"}})
    options = options_of_cell(cell, blend_mm=1.0, rotary="AC", program_number=9)
    assert (options.blend_mm, options.rotary, options.program_number) == (3.0, "BC", 9)
    assert options_of_cell(cell, blend_mm=5.0).blend_mm == 5.0
    assert Options().cell is None
    for wrong in ({"blend": 3}, {"blend_mm": "much"}, {"rotary": "XY"}):
        with pytest.raises(ProcessError, match=next(iter(wrong))):
            options_of_cell(cell_of(programs={"options": wrong}))
    with pytest.raises(ProcessError, match="blend-mm"):
        options_of_cell(cell_of(programs={"options": {"blend_mm": 500}}))


@pytest.mark.parametrize(
    ("name", "on", "off"),
    [
        ("urscript", "set_standard_digital_out(2, True)", "set_standard_digital_out(2, False)"),
        ("rapid", ",doGun,1;", ",doGun,0;"),
        ("krl", "DO $OUT[18]=TRUE", "DO $OUT[18]=FALSE"),
    ],
)
def test_a_gun_is_switched_as_the_robot_passes_the_ends_of_a_line(tmp_path, name, on, off):
    job = painted(force_n=None)
    (path,) = job.paths
    x = np.linspace(0.0, 0.2, 5)
    held = np.tile([1.0, 0.0, 0.0, 0.0], (5, 1))
    places = np.stack([x, 0.0 * x, 0.0 * x + 0.3], axis=1)
    line = Segment("process", 0, places, held, 0.3, tool_on=np.array([0, 1, 1, 1, 0], bool))
    high = np.concatenate([places[:1] + 0.1, places[:1]])
    down = Segment("approach", 0, high, held[:2], 0.3)
    job = replace(job, paths=(replace(path, segments=(down, line)),))
    lines = written(tmp_path, name, job)
    (first,) = (k for k, text in enumerate(lines) if text.endswith(on))
    (last,) = (k for k, text in enumerate(lines) if text.endswith(off))
    blended = {"urscript": "r=0.00100", "rapid": "nrdf_zone", "krl": "C_DIS"}[name]
    moves = [k for k, text in enumerate(lines) if text.lower().startswith(("movel", "lin "))]
    inside = [k for k in moves if first < k < last or (name == "rapid" and k == last)]
    assert len(inside) == 2
    assert all(blended in lines[k] for k in moves if first - 1 <= k <= last)
