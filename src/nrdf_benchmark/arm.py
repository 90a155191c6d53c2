"""The demonstration on the bundled arm, measured against its bars."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from nrdf.bundled import TARGETS
from nrdf.errors import DataError
from nrdf.robot.model.arm import load_arm
from nrdf.robot.report.content import simulation_report
from nrdf.robot.simulation.job import read_simulation_job
from nrdf.robot.simulation.simulate import simulate


@dataclass(frozen=True)
class ArmMetric:
    """name, the bar in words, a value for each report, and whether each meets the bar."""

    name: str
    bar: str
    values: tuple[float, ...]
    met: tuple[bool, ...]


def simulate_demo(folder: Path, progress: Callable[[str], None]) -> dict[str, dict[str, Any]]:
    """The report of each of the demonstration's chairs.

    Raises DataError where `folder` is not what `nrdf demo` wrote.
    """
    missing = [name for name in TARGETS if not (folder / name).is_dir()]
    if missing:
        raise DataError(f"{folder} has no {', '.join(missing)}: nrdf demo --out {folder} first")
    reports = {}
    for name in TARGETS:
        job = read_simulation_job(folder / name)
        progress(name)
        reports[name] = simulation_report(simulate(job, load_arm()))
    return reports


def combine_reports(reports: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """All chairs as one report: shares of all waypoints and of all contact, the worst speeds."""
    paths = [path for report in reports.values() for path in report["paths"]]
    totals = [report["total"] for report in reports.values()]
    speeds = [report["speed"] for report in reports.values()]
    forces = [path["force"] for path in paths if path["force"]]
    contact = sum(force["seconds"] for force in forces)
    within = sum(force["within"] * force["seconds"] for force in forces)
    reached = sum(total["reached"] for total in totals)
    return {
        "paths": paths,
        "total": {
            "reached_share": reached / sum(total["waypoints"] for total in totals),
            "collisions": sum(total["collisions"] for total in totals),
            "force_within": within / contact if contact else None,
            "time_s": sum(total["time_s"] for total in totals),
            "planned_time_s": sum(total["planned_time_s"] for total in totals),
        },
        "speed": {
            "ik_ms_per_waypoint": max(speed["ik_ms_per_waypoint"] for speed in speeds),
            "times_real_time": min(speed["times_real_time"] for speed in speeds),
        },
    }


def measure(reports: dict[str, dict[str, Any]]) -> list[ArmMetric]:
    """What the demonstration must reach, report by report."""

    def metric(
        name: str, bar: str, value: Callable[[dict[str, Any]], float], most: float
    ) -> ArmMetric:
        values = tuple(value(report) for report in reports.values())
        # A bar below 0 is the negative of a least value.
        good = tuple(v <= most if most >= 0.0 else v >= -most for v in values)
        return ArmMetric(name, bar, values, good)

    def worst(report: dict[str, Any], key: str) -> float:
        return max(path[key] for path in report["paths"])

    def lost(report: dict[str, Any], against: str) -> float:
        # Of what was to be done, not of the whole region: what is left out is no excuse.
        parts = [path["coverage"] for path in report["paths"] if path["coverage"][against] > 0.0]
        return max((100.0 * (1.0 - part["achieved"] / part[against]) for part in parts), default=0)

    return [
        metric("waypoints reached, %", "at least 97",
               lambda r: 100.0 * r["total"]["reached_share"], -97.0),
        metric("position error, mm", "at most 0.1",
               lambda r: 1e3 * worst(r, "position_error_m"), 0.1),
        metric("axis error, °", "at most 0.1",
               lambda r: float(np.degrees(worst(r, "axis_error_rad"))), 0.1),
        metric("kinematics, ms a waypoint", "at most 5",
               lambda r: r["speed"]["ik_ms_per_waypoint"], 5.0),
        metric("moves with a collision, all reported", "0",
               lambda r: float(r["total"]["collisions"]), 0.0),
        metric("contact within ±20 % of the force, %", "at least 97",
               lambda r: 100.0 * (r["total"]["force_within"] or 0.0), -97.0),
        metric("coverage lost of the plan, worst region, %", "at most 3",
               lambda r: lost(r, "planned"), 3.0),
        metric("coverage lost of what is executed, worst region, %", "at most 3",
               lambda r: lost(r, "executed"), 3.0),
        metric("planned cycle time off the simulated one, %", "at most 15",
               lambda r: 100.0 * abs(r["total"]["planned_time_s"] / r["total"]["time_s"] - 1.0),
               15.0),
        metric("times faster than real time", "at least 10",
               lambda r: r["speed"]["times_real_time"], -10.0),
    ]  # fmt: skip
