"""The report of a simulation as one HTML file that needs nothing beside it."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from nrdf.reports.page import note, write_html
from nrdf.robot.report.content import COLUMNS, figures
from nrdf.robot.report.pictures import COVERAGE, FILM, STILL

_MOST_LISTED = 40


def write_html_report(folder: Path, report: Mapping[str, Any]) -> None:
    """Write report.html beside the pictures that it shows. Raises OutputError."""
    parts = [
        _head(report),
        _cards(report),
        note("", "Look at", report["warnings"]) if report["warnings"] else "",
        _image(folder / STILL, "the arm at work"),
        f"<h2>Each tool path</h2>{_table(report)}",
        _image(folder / FILM, "the whole job, faster"),
        "<h2>Where the tool really worked</h2><p class='soft'>green: worked; red: not "
        "worked; amber: left out of the plan</p>" + _image(folder / COVERAGE, "coverage")
        if (folder / COVERAGE).is_file()
        else "",
        _missed(report),
        "<h2>What this is worth</h2>" + "".join(f"<p>{escape(n)}</p>" for n in report["notes"]),
        _robot(report),
    ]
    title = f"{report['title']} on {report['robot']['name']}"
    write_html(folder / "report.html", title, parts)


def _head(report: Mapping[str, Any]) -> str:
    place = report["placement"]
    base = " ".join(f"{x:.2f}" for x in place["base_m"])
    turns = len(place["turns_used_rad"])
    words = [
        report.get("date", ""),
        f"robot {report['robot']['name']}",
        f"base at {base} m from under the object, z up",
        f"object {place['stand_m']:.2f} m above the floor, {turns} turns of the turntable",
        place["object_lies"],
    ]
    return f"<h1>{escape(report['title'])}</h1><p class='soft'>{escape(' · '.join(words))}</p>"


def _cards(report: Mapping[str, Any]) -> str:
    total = report["total"]
    minutes, seconds = divmod(round(total["time_s"]), 60)
    within = total["force_within"]
    shown = (
        (f"{total['reached_share']:.1%}", f"of {total['waypoints']} waypoints reached"),
        (str(total["collisions"]), "moves with a collision"),
        ("–" if within is None else f"{within:.1%}", "of contact within ±20 % of the force"),
        (f"{minutes} min {seconds} s", "cycle time"),
    )
    cards = "".join(f'<div class="card"><b>{v}</b><span>{n}</span></div>' for v, n in shown)
    return f'<div class="cards">{cards}</div>'


def _table(report: Mapping[str, Any]) -> str:
    text = ' class="text"'
    names = ("region", "process", *COLUMNS, "pieces", "collisions")
    head = "".join(f"<th{text * (i < 2)}>{name}</th>" for i, name in enumerate(names))
    rows = []
    for path in report["paths"]:
        cells = [*figures(path), str(path["pieces"]), str(len(path["collisions"]))]
        first = "".join(f"<td{text}>{escape(path[k])}</td>" for k in ("region", "process"))
        rows.append(f"<tr>{first}{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>")
    return (
        f'<div class="wide"><table><thead><tr>{head}</tr></thead>'
        f"<tbody>{''.join(rows)}</tbody></table></div>"
    )


def _missed(report: Mapping[str, Any]) -> str:
    lines = [
        f"{path['region']}, {path['process']}: line {m['line']}, index {m['index']}: {m['verdict']}"
        for path in report["paths"]
        for m in path["not_reached"]
    ]
    if not lines:
        return ""
    shown = "".join(f"<li>{escape(line)}</li>" for line in lines[:_MOST_LISTED])
    more = len(lines) - _MOST_LISTED
    rest = f"<p class='soft'>and {more} more, in report.json</p>" if more > 0 else ""
    return f"<h2>Waypoints that are not reached</h2><ul>{shown}</ul>{rest}"


def _robot(report: Mapping[str, Any]) -> str:
    lines = [*report["robot"]["checked"], f"object: {report['object']}"]
    turns = ", ".join(f"{np.degrees(t):.0f}°" for t in report["placement"]["turns_used_rad"])
    lines.append(f"the turntable's turns: {turns}")
    lines += [report["command"]] if "command" in report else []
    return "<h2>How it was made</h2>" + "".join(
        f"<p class='soft'>{escape(line)}</p>" for line in lines
    )


def _image(path: Path, what: str) -> str:
    if not path.is_file():
        return ""
    kind = path.suffix.removeprefix(".")
    content = base64.b64encode(path.read_bytes()).decode()
    return f'<img class="whole" alt="{what}" src="data:image/{kind};base64,{content}">'
