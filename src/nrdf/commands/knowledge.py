"""`nrdf knowledge`: files of process knowledge, begun, checked and described."""

from __future__ import annotations

import logging
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from tyro.conf import Positional

from nrdf.commands.console import console, errors, progress_bar, show, table

if TYPE_CHECKING:
    from nrdf.process.check import CheckedProcess
    from nrdf.process.knowledge import Process

log = logging.getLogger(__name__)


def knowledge() -> dict[str, Callable[..., Any]]:
    """Files of process knowledge: new, check, schema.

    Example: nrdf knowledge new --reference ref.ply --category chair --out chair.yaml
    """
    return {"new": new, "check": check, "schema": schema}


def new(
    reference: Path,
    category: str,
    out: Path,
    region: tuple[Path, ...] = (),
    kind: tuple[str, ...] = ("sand",),
    unit: Literal["m", "cm", "mm", "in"] | None = None,
    model: str | None = None,
    allow_unusual: bool = False,
    overwrite: bool = False,
) -> None:
    """Begin a knowledge file: commented, to be filled in.

    With --region the regions are in it, each with sensible values for its kind of process; without,
    a placeholder says where they go. A name that ends in .json gives JSON, without comments.

    Example: nrdf knowledge new --reference ref.ply --category chair --region seat.ply back.ply
    --kind sand paint --out chair.yaml

    Args:
        reference: Cloud or mesh of the object that is taught: +X forward, +Y up.
        category: chair, car, plane, or what a model was trained on; of the latter give --model.
        out: File to write.
        region: Region files, as `nrdf retrieve` takes them.
        kind: sand, polish, oil, paint, clean, inspect or custom; one a region, or one for all.
        unit: Of the reference's file, where it does not say.
        model: Weight file or training run for a category that the zoo has no model for.
        allow_unusual: Take a category that no model is known for yet.
        overwrite: Replace the file if there is one.
    """
    from nrdf.errors import OutputError
    from nrdf.io.output import output_file
    from nrdf.process.knowledge_file import write_knowledge
    from nrdf.process.new_knowledge import PLACEHOLDER, new_knowledge

    if out.exists() and not overwrite:
        raise OutputError(f"{out} exists; give another name, or --overwrite to replace it")
    with output_file(out, [reference, *region, model]):
        content = new_knowledge(
            reference, category, out.parent, region, kind, unit, model, allow_unusual
        )
        write_knowledge(out, content, explained=True)
    console.print(f"wrote {out}")
    if not region:
        console.print(
            f"next: save a region's points as {out.parent / PLACEHOLDER}.ply (or name another file "
            "in it), then"
        )
    console.print(f"nrdf knowledge check {out}")


def check(file: Positional[Path], model: str | None = None) -> None:
    """Show what a knowledge file says, and whether it is right.

    Every field is checked, the regions are looked for on the reference, and every process is
    planned there. What is wrong is named by field and value, with exit code 2.

    Example: nrdf knowledge check chair.yaml

    Args:
        file: The knowledge file, YAML or JSON.
        model: Weight file or training run for a category that the zoo has no model for.
    """
    from nrdf.errors import ProcessError
    from nrdf.process.bound_knowledge import read_bound_knowledge
    from nrdf.process.check import check_category, check_knowledge
    from nrdf.process.knowledge_file import listed

    lesson = read_bound_knowledge(file)
    with progress_bar("planning on the reference") as progress:
        checked = check_knowledge(lesson, progress)
    reference = lesson.knowledge.reference
    size = lesson.cloud.points.max(axis=0) - lesson.cloud.points.min(axis=0)
    console.print(
        f"{lesson.knowledge.category}, taught on {reference.cloud or 'embedded points'}: "
        f"{len(lesson.cloud)} points, longest side {size.max():.3g} m"
        + (f", frame {lesson.cloud.frame}" if lesson.cloud.frame else "")
    )
    if reference.cloud and reference.sha256 is None:
        log.warning("reference.sha256 is not given: another cloud in its place goes unnoticed")
    _show_asked(checked)
    _show_planned(checked, {name: len(of) for name, of in lesson.regions.items()})
    for row in checked:
        for warning in row.warnings:
            errors.print(f"{row.where}: {warning}", style="yellow")
    faults = [f"{row.where}: {row.fault}" for row in checked if row.fault]
    try:
        if model is not None or not lesson.knowledge.allow_unusual:
            check_category(lesson.knowledge.category, model)
    except ProcessError as error:
        faults.insert(0, f"category: {error}")
    if faults:
        raise ProcessError(listed(str(file), faults))
    console.print(f"{len(checked)} processes on {len(lesson.regions)} regions: nothing is wrong")


def schema(out: Path | None = None) -> None:
    """Print the JSON Schema of knowledge files, for editors.

    Example: nrdf knowledge schema --out knowledge.schema.json

    Args:
        out: File to write instead.
    """
    import json

    from nrdf.io.atomic import write_json
    from nrdf.io.output import output_file
    from nrdf.process.knowledge import Knowledge

    content = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **Knowledge.model_json_schema(),
    }
    if out is None:
        console.print_json(json.dumps(content))
    else:
        with output_file(out):
            write_json(out, content)
        console.print(f"wrote {out}")


def _show_asked(checked: list[CheckedProcess]) -> None:
    shown = table(
        "\nasked for", "region", "process", "trajectory", "stepover", "margin", "lead · tilt",
        "contact", "feed", texts=3,
    )  # fmt: skip
    for row in checked:
        process = row.process
        mode = "" if process.transfer_mode == "replan" else ", warped"
        contact = "standoff_m" if process.standoff_m else "force_n"
        leaning = " · ".join(_said(process, name) for name in ("lead_rad", "tilt_rad"))
        lengths = ("distance_between_lines_m", "edge_margin_m")
        shown.add_row(
            row.region, process.label, f"{process.trajectory}{mode}",
            *(_said(process, name) for name in lengths), leaning, _said(process, contact),
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
    from nrdf.geometry.units import in_words

    value = getattr(process, name)
    return "–" if value is None else in_words(name, value)
