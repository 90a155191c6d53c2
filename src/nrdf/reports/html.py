"""HTML reports from Jinja2 templates: one file each, pictures inside, no network and no script."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined

from nrdf.geometry.units import readable
from nrdf.io.atomic import write_atomically
from nrdf.reports.result_report import feed_in_words, histogram, result_lines
from nrdf.reports.transfer_report import METRIC_COLUMNS, left_out_in_words, metric_cells
from nrdf.viz.heat_map import HeatMap
from nrdf.viz.palette import region_colours
from nrdf.viz.sheet import png_of


def write_html(path: Path, template: str, content: Mapping[str, Any]) -> None:
    """Write a report from one of `reports/templates`, filled with `content`.

    Text is escaped. Raises OutputError if the file cannot be written.
    """
    write_atomically(path, [html_text(template, content).encode()])


def html_text(template: str, content: Mapping[str, Any]) -> str:
    """A report from one of `reports/templates`, filled with `content`."""
    return _templates().get_template(template).render(content)


def write_transfer_html(
    path: Path,
    report: Mapping[str, Any],
    picture: Path,
    details: Mapping[str, np.ndarray],
    heat_maps: Sequence[HeatMap | None] = (),
) -> None:
    """Write the HTML report of a transfer.

    report: from `transfer_report`, with title and seconds. picture: file of the whole target's
    picture. details: by region, a close picture (h, w, 3) with values in [0, 1]. heat_maps: of
    each path's result, where it has one. Raises OutputError if the file cannot be written.
    """
    colours = {
        name: "#" + "".join(f"{round(255 * c):02x}" for c in colour)
        for name, colour in region_colours(list(report["regions"])).items()
    }
    versions = ", ".join(f"{name} {v}" for name, v in report.get("versions", {}).items())
    content = {
        "report": report,
        "header": _header(report),
        "cards": _cards(report),
        "picture": image_source(picture),
        "details": {name: _png_source(image) for name, image in details.items()},
        "colours": colours,
        "columns": list(METRIC_COLUMNS),
        "cells": metric_cells,
        "properties": lambda path: _properties(path, report["regions"][path["region"]]),
        "results": _results(report, heat_maps),
        "surface": _surface(report["surface"]),
        "seconds": ", ".join(f"{name} {value:.2f} s" for name, value in report["seconds"].items()),
        "versions": [versions] if versions else [],
    }
    write_html(path, "transfer.html", content)


def image_source(path: Path) -> str:
    """A picture's file as the source of an <img>: its content in base64; "" without such a file."""
    if not path.is_file():
        return ""
    return _data_source(path.read_bytes(), path.suffix.removeprefix("."))


def duration_in_words(seconds: float) -> str:
    """Seconds as "2 min 5 s"."""
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s"


@cache
def _templates() -> Environment:
    return Environment(
        loader=PackageLoader("nrdf.reports"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )


def _data_source(content: bytes, kind: str) -> str:
    return f"data:image/{kind};base64,{base64.b64encode(content).decode()}"


def _png_source(image: np.ndarray) -> str:
    """A picture (h, w, 3) in [0, 1] as the source of an <img>."""
    return _data_source(png_of(image), "png")


def _results(
    report: Mapping[str, Any], heat_maps: Sequence[HeatMap | None]
) -> list[dict[str, Any]]:
    """Of each path with a target: its name, lines, picture and histogram."""
    made = []
    for path, drawn in zip(report["paths"], heat_maps, strict=False):
        if path.get("result") is not None and drawn is not None:
            made.append(result_block(path, result_lines(path["result"]), drawn))
    return made


def result_block(
    path: Mapping[str, Any], lines: Sequence[tuple[str, str]], drawn: HeatMap
) -> dict[str, Any]:
    """What the template's `results` shows of a path: its lines beside picture and histogram."""
    content = path["result"]
    return {
        "name": f"{path['region']}: {path['process']}",
        "lines": lines,
        "picture": _png_source(drawn.image),
        "bars": histogram(drawn.shares, content["target_m"], content["tolerance_m"]),
    }


def _header(report: Mapping[str, Any]) -> list[str]:
    model = report.get("model", {})
    words = [report.get("date", "")]
    words += [f"model {model['name']}"] if "name" in model else []
    words += [f"knowledge {report['knowledge']}"] if "knowledge" in report else []
    return [*words, f"frame {report['frame'] or 'of the target file'}, positions in metres"]


def _surface(surface: Mapping[str, Any] | None) -> list[str]:
    """The mesh that was planned on, in words; nothing where there is none."""
    if surface is None:
        return []
    edges = readable("edge_length_m", surface["edge_length_m"])
    said = [
        f"Planned on a mesh of {surface['faces']} triangles, edges of {edges}",
        *surface["repairs"],
    ]
    return ["; ".join(said)]


def _cards(report: Mapping[str, Any]) -> list[tuple[str, str]]:
    """The numbers at the top, each with its name."""
    total, regions = report["total"], report["regions"]
    found = sum(region["found"] for region in regions.values())
    covered = [path["metrics"]["coverage"] for path in report["paths"] if path["planned"]]
    return [
        (f"{found} of {len(regions)}", "regions found"),
        (f"{total['paths']} of {total['paths'] + total['skipped']}", "tool paths"),
        (duration_in_words(total["cycle_time_s"]), "cycle time"),
        (f"{total['process_length_m']:.1f} m", "on the surface"),
        (f"{total['path_length_m']:.1f} m", "in all"),
        (f"{min(covered):.1%}" if covered else "–", "least of a region worked"),
    ]


def _properties(path: Mapping[str, Any], region: Mapping[str, Any]) -> list[tuple[str, str]]:
    """What was requested of a tool path, by name and value, as people read it."""
    requested, metrics = path["requested"], path["metrics"]
    tool = requested["tool"]

    def quantity(name: str) -> str:
        return readable(name, requested[name]) if requested.get(name) is not None else "–"

    mode = "planned anew" if path["transfer"] == "replan" else "warped from the reference"
    lines = [("trajectory", f"{requested['trajectory']}, {mode}")]
    if requested.get("direction") is not None:
        lines.append(("direction", " ".join(f"{x:+.2f}" for x in requested["direction"])))
    lines += [
        ("lines, waypoints", f"{path['lines']}, {path['waypoints']}"),
        ("stepover, spacing", f"{quantity('stepover_m')}, {quantity('spacing_m')}"),
        ("edge margin, passes", f"{quantity('edge_margin_m')}, {requested['passes']}"),
        ("tool, radius", f"{tool['name']}, {readable('radius_m', tool['radius_m'])}"),
        ("lead, tilt, stand-off",
         f"{quantity('lead_rad')}, {quantity('tilt_rad')}, {quantity('standoff_m')}"),
        ("force, feed", f"{quantity('force_n')}, {feed_in_words(path, quantity('feed_m_s'))}"),
        ("left out of the region", left_out_in_words(metrics["left_out"])),
    ]  # fmt: skip
    if region["area_m2"] is not None:
        area = f"{1e4 * region['area_m2']:.0f} cm²"
        lines.append(("region", ", ".join([area, *region["changes"]])))
    if metrics["compared_with"] is not None:
        lines.append(("compared with", metrics["compared_with"]))
    if requested.get("spindle_rad_s") is not None:
        lines.append(("spindle", quantity("spindle_rad_s")))
    return lines
