from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from builders.export_jobs import small_job, wild_job
from nrdf.export.options import Options
from nrdf.export.registry import FORMATS, export_job


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


def test_a_tcp_that_is_known_is_set_and_said(tmp_path):
    half = np.sqrt(0.5)
    first, second = (
        replace(path, tcp_m=(0.0, 0.01, 0.12), tcp_quaternion_xyzw=(half, 0.0, 0.0, half),
                force_tolerance_n=2.5)
        for path in wild_job().paths
    )  # fmt: skip
    job = replace(wild_job(), paths=(first, second))
    formats = ["urscript", "rapid", "json"]
    export_job(job, formats, tmp_path)
    (script,) = (tmp_path / "urscript").iterdir()
    text = script.read_text()
    assert text.count(f"set_tcp(p[0.0000000, 0.0100000, 0.1200000, {np.pi / 2:.8f}, ") == 2
    assert "and its TCP set?" not in text and "force within 2.500 N" in text
    (module,) = (tmp_path / "rapid").glob("*.mod")
    assert "TCP 0.000 10.000 120.000 mm" in " ".join(module.read_text().split())
    (content,) = (tmp_path / "json").iterdir()
    assert json.loads(content.read_text())["paths"][0]["tcp_m"] == [0.0, 0.01, 0.12]
    export_job(job, ["urscript"], tmp_path / "out", Options(tool_z="out"))
    (script,) = (tmp_path / "out" / "urscript").iterdir()
    assert f"{-np.pi / 2:.8f}" in script.read_text().split("set_tcp", 1)[1].split("\n")[0]
