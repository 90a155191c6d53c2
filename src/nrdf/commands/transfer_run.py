"""One transfer after another, with the same knowledge and options; the reference once."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from nrdf.commands.console import command_line, console, errors, show, table
from nrdf.process.limits import Limits
from nrdf.serve.object_transfer import ObjectTransfer, reasons_for_nothing

_NAME_WIDTH = 12  # characters


@dataclass
class TransferRun:
    """What all targets of one command share.

    objects: knowledge, model and encoded reference. region_files: regions marked on the one target.
    reports: what report.json says, by job folder, of every target that came so far.
    """

    objects: ObjectTransfer
    region_files: tuple[Path, ...]
    limits: Limits
    strict: bool = False
    overwrite: bool = False
    reports: dict[Path, dict[str, Any]] = field(default_factory=dict)

    def transfer(self, target: Path, out: Path) -> None:
        """Write the job folder `out` of one target, and show what is in it.

        Raises NrdfError for what cannot be used; after writing, LimitError for a limit that is not
        met, and NothingFoundError where no tool path could be planned.
        """
        from nrdf.io.output import check_inputs, output_folder

        objects, file = self.objects, self.objects.knowledge_file
        inputs = [file, target, *self.region_files, objects.model_name]
        with output_folder(out, self.overwrite, inputs) as folder:
            from nrdf.process.bound_knowledge import files_of

            check_inputs(out, files_of(objects.bound.knowledge, file.parent))
            with errors.status("reference") as status:
                result, scan = objects.transfer(target, self.region_files, status.update)
                status.update("report")
                report = objects.write(folder, target, result, scan, self.limits, command_line())
        self.reports[out] = report
        show_transfer(report)
        console.print(f"{_summary(report)}; all in {out}")
        self._check(report)

    def _check(self, report: dict[str, Any]) -> None:
        from nrdf.errors import LimitError, NothingFoundError

        if not report["total"]["paths"]:
            objects = self.objects
            raise NothingFoundError(_nothing_planned(report, objects.category, objects.scan.up))
        not_met, doubtful = (
            report["limits"]["not_met"],
            report["strict_warnings"] if self.strict else [],
        )
        if not_met or doubtful:
            parts = (("limits not met", not_met), ("doubtful, with --strict", doubtful))
            lines = [line for title, of in parts if of for line in (f"{title}:", *_indented(of))]
            raise LimitError("\n".join(lines))


def _nothing_planned(report: dict[str, Any], category: str, up: str | None) -> str:
    """Why a transfer ends without any tool path, region by region, and what to try."""
    reasons = reasons_for_nothing(report)
    try_ = (
        f"is this a {category}, upright (+Y up) and facing +X? For a scan in another pose try "
        "--up z (or x, y, -z, auto)"
        if up is None
        else f"is this a {category}, and is {up} the direction that points up? See `nrdf align`"
    )
    return "\n".join(["no tool path could be planned:", *_indented(reasons), try_])


def _indented(lines: Iterable[str]) -> list[str]:
    return [f"  {line}" for line in lines]


def show_transfer(report: dict[str, Any]) -> None:
    """A table of a transfer's tool paths, and its warnings."""
    from nrdf.reports.transfer_report import SHORT_METRIC_COLUMNS, short_metric_cells

    none = ["–"] * len(SHORT_METRIC_COLUMNS)
    shown = table("", "region", "process", "sure", *SHORT_METRIC_COLUMNS, texts=2)
    for path in report["paths"]:
        confidence = f"{report['regions'][path['region']]['confidence']:.2f}"
        cells = short_metric_cells(path["metrics"]) if path["planned"] else none
        style = None if path["planned"] else "dim"
        shown.add_row(path["region"], path["process"], confidence, *cells, style=style)
    longest = max((len(path["region"]) for path in report["paths"]), default=0)
    shown.columns[0].no_wrap = longest <= _NAME_WIDTH  # else it would be the first to be broken
    show(shown)
    for warning in report["warnings"]:
        errors.print(warning, style="yellow")


def _summary(report: dict[str, Any]) -> str:
    total = report["total"]
    minutes, seconds = divmod(round(total["cycle_time_s"]), 60)
    return f"{total['paths']} tool paths, {minutes} min {seconds} s"
