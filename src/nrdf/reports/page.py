"""The report as one HTML file that needs nothing beside it: no network, no script."""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from nrdf.geometry.units import in_words
from nrdf.io.atomic import write_atomically
from nrdf.reports.transfer_report import METRIC_COLUMNS, left_out_in_words, metric_cells
from nrdf.viz.palette import region_colours

_STYLE = """
:root { --ink: #1f2328; --soft: #656d76; --line: #d8dee4; --bad: #b42318; --good: #1a7f37; }
* { box-sizing: border-box; }
body { font: 15px/1.5 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; color: var(--ink);
  margin: 0 auto; max-width: 1180px; padding: 28px 24px 60px; background: #fff; }
h1 { font-size: 25px; margin: 0; } h2 { font-size: 18px; margin: 34px 0 10px; }
p { margin: 4px 0; } .soft { color: var(--soft); }
.whole { display: block; max-width: 100%; margin: 14px auto; }
.cards { display: grid; grid-template-columns: repeat(auto-fill, minmax(150px, 1fr)); gap: 10px;
  margin-top: 16px; }
.card { border: 1px solid var(--line); border-radius: 8px; padding: 8px 12px; }
.card b { display: block; font-size: 20px; font-variant-numeric: tabular-nums; }
.card span { color: var(--soft); font-size: 13px; }
.note { border-left: 4px solid #d4a72c; background: #fff8e5; padding: 8px 12px; margin: 12px 0; }
.note.bad { border-color: var(--bad); background: #fdecea; }
.note.good { border-color: var(--good); background: #eaf6ec; }
.note ul { margin: 4px 0; padding-left: 20px; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
th { font-weight: 600; font-size: 12.5px; color: var(--soft); text-align: right;
  vertical-align: bottom; }
td, th { padding: 6px 8px; border-bottom: 1px solid var(--line); }
td { white-space: nowrap; }
td { text-align: right; } td.text, th.text { text-align: left; }
td.off { color: var(--bad); font-weight: 600; } tr.none td { color: var(--soft); }
i.dot { display: inline-block; width: 11px; height: 11px; border-radius: 3px; margin-right: 7px; }
.paths { display: grid; grid-template-columns: repeat(auto-fill, minmax(530px, 1fr)); gap: 16px; }
.path { display: flex; gap: 14px; border: 1px solid var(--line); border-radius: 8px;
  padding: 12px; }
.path img { width: 200px; height: 200px; } .path h3 { margin: 0 0 4px; font-size: 16px; }
dl { display: grid; grid-template-columns: auto 1fr; gap: 1px 12px; margin: 6px 0 0;
  font-size: 13.5px; } dt { color: var(--soft); } dd { margin: 0; }
code { font-size: 12.5px; word-break: break-word; }
@media print { .path, .card { break-inside: avoid; } body { padding: 0; } }
"""
_COLUMNS = ("region", "process", "confidence", *METRIC_COLUMNS)


def write_page(
    path: Path, report: Mapping[str, Any], picture: Path, details: Mapping[str, np.ndarray]
) -> None:
    """Write the page of a transfer's report. picture: of the whole target; details: a close one
    (h, w, 3) in [0, 1] for each region. Raises OutputError if it cannot be written."""
    close = {name: _png(image) for name, image in details.items()}
    colours = {
        name: "#" + "".join(f"{round(255 * c):02x}" for c in colour)
        for name, colour in region_colours(list(report["regions"])).items()
    }
    whole = base64.b64encode(picture.read_bytes()).decode()
    parts = [
        _head(report),
        _cards(report) + _notes(report),
        f'<img class="whole" alt="{escape(report["title"])}" src="data:image/png;base64,{whole}">',
        f"<h2>Tool paths, in the order they are driven</h2>{_table(report, colours)}",
        f'<h2>Each of them</h2><div class="paths">{_details(report, close, colours)}</div>',
        _foot(report),
    ]
    write_html(path, f"{report['category']}: {report['title']}", parts)


def write_html(path: Path, title: str, parts: Sequence[str]) -> None:
    """Write a page in the reports' style; title: plain text, parts: HTML."""
    text = (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title><style>{_STYLE}</style></head>\n<body>"
        + "\n".join(parts)
        + "</body></html>\n"
    )
    write_atomically(path, [text.encode()])


def _head(report: Mapping[str, Any]) -> str:
    model = report.get("model", {})
    words = [report.get("date", "")]
    words += [f"model {model['name']}"] if "name" in model else []
    words += [f"knowledge {report['knowledge']}"] if "knowledge" in report else []
    words += [f"frame {report['frame'] or 'of the target file'}, positions in metres"]
    return f'<h1>{escape(report["title"])}</h1><p class="soft">{escape(" · ".join(words))}</p>'


def _cards(report: Mapping[str, Any]) -> str:
    total, regions = report["total"], report["regions"]
    found = sum(region["found"] for region in regions.values())
    minutes, seconds = divmod(round(total["cycle_time_s"]), 60)
    covered = [p["metrics"]["coverage"] for p in report["paths"] if p["planned"]]
    shown = (
        (f"{found} of {len(regions)}", "regions found"),
        (f"{total['paths']} of {total['paths'] + total['skipped']}", "tool paths"),
        (f"{minutes} min {seconds} s", "cycle time"),
        (f"{total['process_length_m']:.1f} m", "on the surface"),
        (f"{total['path_length_m']:.1f} m", "in all"),
        (f"{min(covered):.1%}" if covered else "–", "least of a region worked"),
    )
    cards = "".join(f'<div class="card"><b>{v}</b><span>{n}</span></div>' for v, n in shown)
    return f'<div class="cards">{cards}</div>'


def _notes(report: Mapping[str, Any]) -> str:
    limits = report["limits"]
    parts = []
    if limits["not_met"]:
        parts.append(note("bad", "Limits not met", limits["not_met"]))
    elif limits["set"]:
        parts.append('<div class="note good">Every limit that was set is met.</div>')
    if report["warnings"]:
        parts.append(note("", "Look at", report["warnings"]))
    return "".join(parts)


def note(kind: str, title: str, lines: Sequence[str]) -> str:
    items = "".join(f"<li>{escape(line)}</li>" for line in lines)
    return f'<div class="note {kind}"><b>{title}</b><ul>{items}</ul></div>'


def _table(report: Mapping[str, Any], colours: Mapping[str, str]) -> str:
    text = ' class="text"'
    head = "".join(
        f"<th{text * (i < 2)}>{name.replace(', ', '<br>')}</th>" for i, name in enumerate(_COLUMNS)
    )
    rows = []
    for path in report["paths"]:
        confidence = report["regions"][path["region"]]["confidence"]
        first = (
            f'<td class="text"><i class="dot" style="background:{colours[path["region"]]}"></i>'
            f'{escape(path["region"])}</td><td class="text">{escape(path["process"])}</td>'
            f"<td>{confidence:.2f}</td>"
        )
        if not path["planned"]:
            why = escape(path["reason"] or "")
            span = len(METRIC_COLUMNS)
            rows.append(
                f'<tr class="none">{first}<td class="text" colspan="{span}">{why}</td></tr>'
            )
            continue
        cells = "".join(f"<td>{cell}</td>" for cell in metric_cells(path["metrics"]))
        rows.append(f"<tr>{first}{cells}</tr>")
    table = f"<thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody>"
    return f'<div class="wide"><table>{table}</table></div>'


def _details(
    report: Mapping[str, Any], details: Mapping[str, str], colours: Mapping[str, str]
) -> str:
    parts = []
    for path in report["paths"]:
        if not path["planned"]:
            continue
        name = path["region"]
        lines = "".join(f"<dt>{escape(k)}</dt><dd>{escape(v)}</dd>" for k, v in _said(path))
        parts.append(
            f'<div class="path"><img alt="{escape(name)}" src="data:image/png;base64,'
            f'{details[name]}"><div><h3><i class="dot" style="background:{colours[name]}"></i>'
            f"{escape(name)}: {escape(path['process'])}</h3><dl>{lines}</dl></div></div>"
        )
    return "".join(parts)


def _said(path: Mapping[str, Any]) -> list[tuple[str, str]]:
    """What a path is, by name and value, as people read it."""
    requested = path["requested"]
    tool = requested["tool"]

    def quantity(name: str) -> str:
        return in_words(name, requested[name]) if requested.get(name) is not None else "–"

    way = "planned anew" if path["transfer"] == "replan" else "warped from the reference"
    direction = requested.get("direction")
    lines = [
        ("trajectory", f"{requested['trajectory']}, {way}"),
        ("lines, waypoints", f"{path['lines']}, {path['waypoints']}"),
        ("stepover, spacing", f"{quantity('stepover_m')}, {quantity('spacing_m')}"),
        ("edge margin, passes", f"{quantity('edge_margin_m')}, {requested['passes']}"),
        ("tool, radius", f"{tool['name']}, {in_words('radius_m', tool['radius_m'])}"),
        ("lead, tilt, stand-off",
         f"{quantity('lead_rad')}, {quantity('tilt_rad')}, {quantity('standoff_m')}"),
        ("force, feed", f"{quantity('force_n')}, {quantity('feed_m_s')}"),
    ]  # fmt: skip
    metrics = path["metrics"]
    lines.append(("left out of the region", left_out_in_words(metrics["left_out"])))
    if metrics["compared_with"] is not None:
        lines.append(("compared with", metrics["compared_with"]))
    if requested.get("spindle_rad_s") is not None:
        lines.append(("spindle", quantity("spindle_rad_s")))
    if direction is not None:
        lines.insert(1, ("direction", " ".join(f"{x:+.2f}" for x in direction)))
    return lines


def _foot(report: Mapping[str, Any]) -> str:
    seconds = ", ".join(f"{name} {value:.2f} s" for name, value in report["seconds"].items())
    versions = ", ".join(f"{n} {v}" for n, v in report.get("versions", {}).items())
    lines = [f"Took: {seconds}."]
    lines += [f"<code>{escape(report['command'])}</code>"] if "command" in report else []
    lines += [escape(versions)] if versions else []
    return "<h2>How it was made</h2>" + "".join(f'<p class="soft">{line}</p>' for line in lines)


def _png(image: np.ndarray) -> str:
    """A picture (h, w, 3) in [0, 1] as base64 PNG."""
    from matplotlib.image import imsave

    file = io.BytesIO()
    imsave(file, (255 * image).astype(np.uint8), format="png")
    return base64.b64encode(file.getvalue()).decode()
