"""The HTML report of a simulation: one file with its pictures inside."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from nrdf.reports.html import duration_in_words, image_source, result_block, write_html
from nrdf.reports.result_report import executed_lines
from nrdf.robot.report.content import COLUMNS, metrics_row
from nrdf.robot.report.pictures import COVERAGE, FILM, STILL
from nrdf.viz.heat_map import HeatMap


def write_html_report(
    folder: Path, report: Mapping[str, Any], heat_maps: Sequence[HeatMap | None] = ()
) -> None:
    """Write report.html beside the pictures that it shows. Raises OutputError.

    heat_maps: one a path, of what it left; None for those without a target.
    """
    content = {
        "report": report,
        "header": _header(report),
        "cards": _cards(report),
        "columns": ["region", "process", *COLUMNS, "joint paths", "collisions"],
        "cells": _cells,
        "still": image_source(folder / STILL),
        "film": image_source(folder / FILM),
        "coverage": image_source(folder / COVERAGE),
        "results": [
            result_block(path, executed_lines(path["result"]), drawn)
            for path, drawn in zip(report["paths"], heat_maps, strict=False)
            if drawn is not None
        ],
        "not_reached": _not_reached(report),
        "made": _how_it_was_made(report),
    }
    write_html(folder / "report.html", "simulation.html", content)


def _header(report: Mapping[str, Any]) -> list[str]:
    placement = report["placement"]
    base = " ".join(f"{x:.2f}" for x in placement["base_m"])
    angles = len(placement["turntable_used_rad"])
    return [
        report.get("date", ""),
        f"robot {report['robot']['name']}",
        f"base at {base} m from under the object, z up",
        f"object {placement['stand_m']:.2f} m above the floor, {angles} turntable angles",
        placement["object_pose"],
    ]


def _cards(report: Mapping[str, Any]) -> list[tuple[str, str]]:
    """The numbers at the top, each with its name."""
    total = report["total"]
    within = total["force_within"]
    return [
        (f"{total['reached_share']:.1%}", f"of {total['waypoints']} waypoints reached"),
        (str(total["collisions"]), "moves with a collision"),
        ("–" if within is None else f"{within:.1%}", "of contact within ±20 % of the force"),
        (duration_in_words(total["time_s"]), "cycle time"),
    ]


def _cells(path: Mapping[str, Any]) -> list[str]:
    return [*metrics_row(path), str(path["joint_paths"]), str(len(path["collisions"]))]


def _not_reached(report: Mapping[str, Any]) -> list[str]:
    return [
        f"{path['region']}, {path['process']}: line {m['line']}, index {m['index']}: {m['verdict']}"
        for path in report["paths"]
        for m in path["not_reached"]
    ]


def _how_it_was_made(report: Mapping[str, Any]) -> list[str]:
    angles = ", ".join(f"{np.degrees(t):.0f}°" for t in report["placement"]["turntable_used_rad"])
    command = [report["command"]] if "command" in report else []
    return [
        *report["robot"]["checked"],
        f"object: {report['object']}",
        f"turntable angles: {angles}",
        *command,
    ]
