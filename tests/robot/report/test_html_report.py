"""The HTML report of a simulation: complete, escaped, with the pictures that are there."""

from __future__ import annotations

from importlib.util import find_spec

import pytest

# Not by importing it: nrdf must be first, to choose what MuJoCo draws with.
if find_spec("mujoco") is None:
    pytest.skip("pip install 'nrdf[robot]'", allow_module_level=True)

from nrdf.robot.report.html_report import write_html_report

PATH = {
    "region": "top", "process": "sand <fine>", "reached": 58, "waypoints": 100, "joint_paths": 3,
    "collisions": [{}], "off_plan_99_m": 0.0004, "time_s": 12.0,
    "force": {"mean_n": 10.0, "spread_n": 0.5, "within": 0.97},
    "coverage": {
        "achieved": 0.95, "planned": 0.99, "left_out": {"edge_margin": 0.01}, "unreached": 0.02,
    },
    "not_reached": [{"line": 0, "index": k, "verdict": "collision"} for k in range(42)],
}  # fmt: skip
REPORT = {
    "title": "plate <1>",
    "robot": {"name": "arm & tool", "checked": ["reach < 2 m"]},
    "placement": {
        "base_m": [0.75, 0.0, 0.3], "turntable_used_rad": [0.0, 1.5707963], "stand_m": 0.1,
        "object_pose": "as the job says",
    },
    "object": "the scan",
    "paths": [PATH],
    "total": {
        "reached_share": 0.58, "waypoints": 100, "collisions": 1, "force_within": None,
        "time_s": 125.2,
    },
    "warnings": ["1 move touches the object"],
    "notes": ["This is a simulation."],
}  # fmt: skip


def test_a_report_says_how_the_job_went(tmp_path):
    write_html_report(tmp_path, {**REPORT, "command": "nrdf simulate job"})
    page = (tmp_path / "report.html").read_text()
    for shown in (
        "plate &lt;1&gt; on arm &amp; tool", "58.0%", "of 100 waypoints reached", "2 min 5 s",
        "1 move touches the object", "sand &lt;fine&gt;", "10.0 ± 0.5 N", "0.4 mm", "0°, 90°",
        "reach &lt; 2 m", "This is a simulation.", "nrdf simulate job", "2 turntable angles",
    ):  # fmt: skip
        assert shown in page
    assert "<fine>" not in page and "<script" not in page and "<img" not in page


def test_long_lists_of_missed_waypoints_are_cut(tmp_path):
    write_html_report(tmp_path, REPORT)
    page = (tmp_path / "report.html").read_text()
    assert page.count("line 0, index") == 40 and "and 2 more, in report.json" in page
    write_html_report(tmp_path, {**REPORT, "paths": [{**PATH, "not_reached": []}]})
    assert "Waypoints that are not reached" not in (tmp_path / "report.html").read_text()


def test_pictures_that_are_there_are_shown(tmp_path):
    for name in ("coverage.png", "film.webp"):
        (tmp_path / name).write_bytes(name.encode())
    write_html_report(tmp_path, REPORT)
    page = (tmp_path / "report.html").read_text()
    assert "data:image/webp;base64,ZmlsbS53ZWJw" in page and "Where the tool really worked" in page
    assert page.count("<img") == 2
