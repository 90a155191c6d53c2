"""What all exports share: blends, names, options, and what bad input is told."""

from __future__ import annotations

import json
import sys
from dataclasses import replace

import numpy as np
import pytest
import tyro

from builders.export_jobs import small_job, wild_job
from builders.read_programs import read_krl, read_lines, read_rapid, read_urscript
from nrdf.commands.export import export
from nrdf.errors import OutputError, ProcessError
from nrdf.export.names import identifier, number, plain_text
from nrdf.export.options import Options
from nrdf.export.prepare import blended_segments
from nrdf.export.registry import FORMATS, export_job
from nrdf.io.result_folder import MANIFEST
from nrdf.toolpath.file import write_toolpaths
from nrdf.toolpath.types import Job, Segment, ToolPath

DOWN = np.array([1.0, 0.0, 0.0, 0.0])


def straight(kind, *x_mm, force=None, dwell=0.0):
    """A segment along x with the tool straight down."""
    positions = np.array([[x / 1000, 0.0, 0.0] for x in x_mm])
    turned = np.tile(DOWN, (len(x_mm), 1))
    return Segment(kind, 0, positions, turned, 0.1, force, dwell)


def path_of(*segments, tool="disc", region="seat"):
    return ToolPath(region, "sand", tool, 0.025, segments)


def job_of(*paths):
    return Job("chair", "cell", paths)


def blends_mm(*segments, blend_mm=5.0):
    return [
        np.round(1000 * s.blends_m, 6).tolist()
        for s in blended_segments(path_of(*segments), blend_mm / 1e3)
    ]


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


def test_robots_stop_where_contact_begins_and_ends(tmp_path):
    export_job(wild_job(), ["rapid", "krl"], tmp_path)
    moves = [
        line for line in read_lines(tmp_path / "rapid/nrdf_chair.mod", "\r\n") if "Move" in line
    ]
    stops = [i for i, line in enumerate(moves) if ",fine," in line]
    assert stops == [0, 2, 27, 31, 56, 63, 64, 65, 73]
    moves = [line for line in read_lines(tmp_path / "krl/nrdf_chair.src", "\r\n") if "{" in line]
    assert [i for i, line in enumerate(moves) if not line.endswith(" C_DIS")] == stops


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


@pytest.mark.parametrize("name", [name for name in FORMATS if name != "ros2-bag"])
def test_a_header_says_how_the_object_lies_or_that_nothing_does(tmp_path, name):
    for place, job, said in (
        ("new", small_job(), "up for the object is 0.0000 0.0000 1.0000"),
        ("early", replace(small_job(), pose=None), "does not say how the object lies"),
    ):
        (tmp_path / place).mkdir()
        files = export_job(job, [name], tmp_path / place)[name]
        text = " ".join((tmp_path / place / files[-1]).read_text().split())
        text = text.replace(") (", " ").replace("$$ ", "").replace("# ", "").replace("; ", "")
        assert said.lower() in text.lower()


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


EVIL = [
    "../../etc/passwd",
    "a\r\nEND\r\nDEF x( )",
    "%s {0} $(rm)",
    'seat"; halt()',
    "日本",
    "7",
    "nul.x",
]


@pytest.mark.parametrize("evil", EVIL)
def test_no_name_is_a_path_or_a_statement(tmp_path, evil):
    path = path_of(straight("approach", 0, 50), straight("process", 60, 99, force=1.0), region=evil)
    job = Job(evil, evil, (replace(path, tool=evil, process=evil),))
    formats = [name for name in FORMATS if name != "ros2-bag"]
    export_job(job, formats, tmp_path / "out", Options(program=evil))
    assert [p.name for p in tmp_path.iterdir()] == ["out"]
    files = [path for path in (tmp_path / "out").rglob("*") if path.is_file()]
    assert len(files) == len(formats) + 1
    by_format = {file.parent.name: file for file in files if file.suffix != ".dat"}
    for read, name in ((read_krl, "krl"), (read_rapid, "rapid"), (read_urscript, "urscript")):
        assert [len(path) for path in read(by_format[name])] == [4]
    for name in ("csv", "noether", "apt", "gcode"):
        read_lines(by_format[name])


def test_long_names_are_cut_to_what_a_controller_takes(tmp_path):
    job = job_of(*(path_of(straight("process", 0, 9), region="r" * 90) for _ in range(2)))
    job = replace(job, category="c" * 90, frame="f" * 90)
    export_job(job, ["krl", "rapid"], tmp_path)
    (source,) = (tmp_path / "krl").glob("*.src")
    (module,) = (tmp_path / "rapid").glob("*.mod")
    assert len(source.stem) == 24 and len(module.stem) == 28
    assert len(read_krl(source)) == len(read_rapid(module)) == 2


def test_names_and_numbers():
    assert plain_text("Größe (ø) 5%") == "Gro_e ___ 5_"
    assert plain_text("  ") == "unnamed"
    assert identifier("  9 lives!", 8) == "n_9_live"
    assert identifier("Rückenlehne links", 40) == "Ruckenlehne_links"
    assert identifier("_", 8) == "n"
    assert identifier("a_b_c", 4) == "a_b"
    assert [number(x, 3) for x in (-0.0, -1e-9, 1e-9, -0.0005001, 12345.6789)] == [
        "0.000",
        "0.000",
        "0.000",
        "-0.001",
        "12345.679",
    ]


@pytest.mark.parametrize(
    "formats, program",
    [
        ("rapid", "EndProc"),
        ("krl", "Lin"),
        ("urscript", "force_mode"),
        ("apt", "CON"),
        ("csv", "nul"),
    ],
)
def test_a_name_that_the_controller_keeps_is_refused(tmp_path, formats, program):
    with pytest.raises(ProcessError, match=f"--program {program}: .* has a use of its own"):
        export_job(small_job(), [formats], tmp_path, Options(program=program))


def test_tools_that_rapid_cannot_tell_apart_are_refused(tmp_path):
    job = job_of(*(path_of(straight("process", 0, 9), tool=t) for t in ("disc-1", "Disc 1")))
    with pytest.raises(ProcessError, match="'disc-1' and 'Disc 1' would both be called Disc_1"):
        export_job(job, ["rapid"], tmp_path)


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


def test_gcode_has_six_work_offsets(tmp_path):
    with pytest.raises(ProcessError, match="--frame-number 7: gcode has 1 to 6"):
        export_job(small_job(), ["gcode"], tmp_path, Options(frame_number=7))


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


def test_unknown_format_lists_the_known(tmp_path):
    with pytest.raises(ProcessError, match="no export format 'urscirpt'; known: ros2-bag, noether"):
        export_job(small_job(), ["csv", "urscirpt"], tmp_path)
    with pytest.raises(ProcessError, match="no format given; known: ros2-bag"):
        export_job(small_job(), [], tmp_path)
    assert list(tmp_path.iterdir()) == []
    export_job(small_job(), ["csv", "csv"], tmp_path)
    with pytest.raises(OutputError, match="cannot make the folder"):
        export_job(small_job(), ["csv"], tmp_path)


def test_missing_rosbags_names_the_extra(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "rosbags.rosbag2", None)
    with pytest.raises(ProcessError, match=r"needs the package rosbags: pip install 'nrdf\[ros\]'"):
        export_job(small_job(), ["ros2-bag"], tmp_path)


def run(*words: str):
    """`nrdf export` with `words`."""
    return tyro.cli(export, args=list(words), config=(tyro.conf.FlagCreatePairsOff,))


def test_verb_writes_beside_the_job_unless_told_where(tmp_path, capsys):
    write_toolpaths(tmp_path, small_job())
    run(str(tmp_path), "--format", "csv", "krl", "--blend-mm", "0", "--process-only")
    out = tmp_path / "export"
    report = json.loads((out / "report.json").read_text())
    found = sorted(p.relative_to(out).as_posix() for p in out.rglob("*") if p.is_file())
    assert sorted([MANIFEST, *report["files"]]) == found
    assert report["formats"]["krl"] == ["krl/nrdf_plate.dat", "krl/nrdf_plate.src"]
    assert report["options"]["blend_mm"] == 0 and report["options"]["process_only"] is True
    assert "2 tool paths written to" in capsys.readouterr().out
    with pytest.raises(OutputError, match=r"not empty.*--overwrite"):
        run(str(tmp_path), "--format", "csv")
    run(str(tmp_path / "toolpaths.json"), "--format", "apt", "--overwrite")
    left = sorted(p.relative_to(out).as_posix() for p in out.rglob("*") if p.is_file())
    assert left == [MANIFEST, "apt/nrdf_plate.apt", "report.json"]


def test_verb_leaves_nothing_behind_where_it_fails(tmp_path):
    with pytest.raises(ProcessError, match=r"cannot read the tool paths.*toolpaths\.json"):
        run(str(tmp_path), "--format", "csv", "--out", str(tmp_path / "out"))
    path = write_toolpaths(tmp_path, small_job())
    for words in (["--format", "csv", "krk"], ["--format", "csv", "krl", "--program", "if"]):
        with pytest.raises(ProcessError):
            run(str(tmp_path), *words, "--out", str(tmp_path / "out"))
    path.write_text(path.read_text().replace('"version":3', '"version":99'))
    with pytest.raises(ProcessError, match="version 99; this nrdf reads versions up to 3"):
        run(str(tmp_path), "--format", "csv", "--out", str(tmp_path / "out"))
    assert list(tmp_path.iterdir()) == [path]
