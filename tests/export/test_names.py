from __future__ import annotations

from dataclasses import replace

import pytest

from builders.export_checks import (
    path_of,
    straight,
)
from builders.export_jobs import small_job
from builders.read_programs import (
    read_krl,
    read_lines,
    read_rapid,
    read_urscript,
)
from nrdf.errors import ProcessError
from nrdf.export.names import identifier, number, plain_text
from nrdf.export.options import Options
from nrdf.export.registry import FORMATS, export_job
from nrdf.toolpath.types import Job

EVIL = [
    "../../etc/passwd",
    "a\r\nEND\r\nDEF x( )",
    "%s {0} $(rm)",
    'seat"; halt()',
    "日本",
    "7",
    "nul.x",
]


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
