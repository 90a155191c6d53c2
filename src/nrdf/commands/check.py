"""`nrdf check`: what a knowledge file says, and whether it is right."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from tyro.conf import Positional

from nrdf.commands.console import console, errors, progress_bar, show, table
from nrdf.commands.options import File

if TYPE_CHECKING:
    from nrdf.process.check import CheckedProcess
    from nrdf.process.process import Process

log = logging.getLogger(__name__)


def check(file: Positional[File], model: str | None = None) -> None:
    """Show what a knowledge file says, and whether it is right.

    Every field is checked, every region is looked for on the reference, and every process is
    planned there. What is wrong is named by field and value, with exit code 2.

    Example: nrdf check chair.yaml

    Args:
        file: The knowledge file, YAML or JSON.
        model: Zoo name, weight file or run, or registration; what the file says, or the category's,
            unless given.
    """
    from nrdf.errors import ProcessError
    from nrdf.io.model_file import listed
    from nrdf.process.bound_knowledge import read_bound_knowledge
    from nrdf.process.check import check_knowledge
    from nrdf.process.model_choice import choose_model

    bound = read_bound_knowledge(file)
    with progress_bar("planning on the reference") as progress:
        checked = check_knowledge(bound, progress)
    reference = bound.knowledge.reference
    size = bound.cloud.points.max(axis=0) - bound.cloud.points.min(axis=0)
    console.print(
        f"{bound.knowledge.category}, taught on {reference.cloud or 'encoded points'}: "
        f"{len(bound.cloud)} points, longest side {size.max():.3g} m"
        + (f", frame {bound.cloud.frame}" if bound.cloud.frame else "")
    )
    if reference.cloud and reference.sha256 is None:
        log.warning("reference.sha256 is not given: another cloud in its place goes unnoticed")
    _show_asked(checked)
    _show_planned(checked, {name: len(of) for name, of in bound.regions.items()})
    for row in checked:
        for warning in row.warnings:
            errors.print(f"{row.where}: {warning}", style="yellow")
    faults = [f"{row.where}: {row.fault}" for row in checked if row.fault]
    try:
        said = bound.knowledge
        chosen = choose_model(said.category, model or said.model, said.allow_unusual)
        console.print(chosen.note or f"its regions are found with the model {chosen.name}")
    except ProcessError as error:
        faults.insert(0, f"category: {error}")
    if faults:
        raise ProcessError(listed(str(file), faults))
    console.print(f"{len(checked)} processes on {len(bound.regions)} regions: nothing is wrong")


def _show_asked(checked: list[CheckedProcess]) -> None:
    shown = table(
        "\nasked for", "region", "process", "trajectory", "stepover", "margin", "lead · tilt",
        "contact", "feed", texts=3,
    )  # fmt: skip
    for row in checked:
        process = row.process
        mode = "" if process.transfer_mode == "replan" else ", warped"
        contact = "standoff_m" if process.standoff_m else "force_n"
        angles = " · ".join(_said(process, name) for name in ("lead_rad", "tilt_rad"))
        lengths = ("distance_between_lines_m", "edge_margin_m")
        shown.add_row(
            row.region, process.label, f"{process.trajectory}{mode}",
            *(_said(process, name) for name in lengths), angles, _said(process, contact),
            _said(process, "feed_m_s"),
        )  # fmt: skip
    show(shown)


def _show_planned(checked: list[CheckedProcess], points: dict[str, int]) -> None:
    from nrdf.reports.transfer_report import SHORT_METRIC_COLUMNS, short_metric_cells

    shown = table("\nplanned on the reference", "region", "points", *SHORT_METRIC_COLUMNS)
    for row in checked:
        missing = row.metrics is None
        cells = (
            ["–"] * len(SHORT_METRIC_COLUMNS) if missing else short_metric_cells(vars(row.metrics))
        )
        shown.add_row(row.region, str(points[row.region]), *cells)
    show(shown)


def _said(process: Process, name: str) -> str:
    from nrdf.geometry.units import readable

    value = getattr(process, name)
    return "–" if value is None else readable(name, value)
