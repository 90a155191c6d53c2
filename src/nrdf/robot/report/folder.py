"""A simulation as a folder."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from nrdf.io.atomic import write_json
from nrdf.io.result_folder import REPORT
from nrdf.robot.report.content import executed_heat_maps, simulation_report
from nrdf.robot.report.html_report import write_html_report
from nrdf.robot.report.pictures import draw_pictures
from nrdf.robot.report.trajectories import write_bag, write_csv, write_script
from nrdf.robot.simulation.simulate import SimulationResult


def write_simulation(
    folder: Path,
    result: SimulationResult,
    title: str,
    origin: Mapping[str, Any],
    pictures: bool = True,
    film: bool = True,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> dict[str, Any]:
    """Write a simulation into an existing folder; what its report.json says.

    joints.csv, joints.bag (with rosbags) and joints.script (arms of six axes), report.json,
    report.html, and, where this machine can draw, picture.png, coverage.png and film.webp. Raises
    OutputError if something cannot be written.
    """
    report = {"title": title, **simulation_report(result), **origin}
    report["seconds"] = {name: round(value, 3) for name, value in result.seconds.items()}
    report["date"] = datetime.now(timezone.utc).isoformat(timespec="seconds")
    write_csv(folder, result)
    if not write_bag(folder, result):
        report["warnings"].append("no ROS 2 bag: it needs rosbags, pip install 'nrdf[ros]'")
    if len(result.arm.joint_names) == 6:
        write_script(folder, result)
    if pictures:
        missing = draw_pictures(folder, result, film, progress)
        report["warnings"] += [missing] if missing else []
    write_html_report(folder, report, executed_heat_maps(result))
    files = sorted(str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file())
    report["files"] = [*files, REPORT]
    write_json(folder / REPORT, report)
    return report
