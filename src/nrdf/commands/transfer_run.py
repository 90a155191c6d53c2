"""One transfer after another, with the same knowledge and options; the reference once."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nrdf.commands.console import command_line, console, errors, provenance, show, table, versions
from nrdf.commands.scan_input import (
    ScanOptions,
    alignment_examples,
    describe_alignment,
    read_scan,
)

if TYPE_CHECKING:
    from nrdf.process.bound_knowledge import BoundKnowledge
    from nrdf.process.limits import Limits
    from nrdf.process.transfer import ProcessTransfer
    from nrdf.process.transfer_result import TransferResult
    from nrdf.regions.model import Model
    from nrdf.scans.aligned_scan import AlignedScan

_NAME_WIDTH = 12  # characters


@dataclass
class TransferRun:
    """What all targets of one command share.

    Knowledge, model and encoded reference are read when the first target needs them. reports: what
    report.json says, by job folder, of every target that came so far.
    """

    knowledge_file: Path
    model_name: str | None
    device: str
    scan: ScanOptions
    region_files: tuple[Path, ...]
    min_confidence: float | None
    limits: Limits
    strict: bool = False
    overwrite: bool = False
    reports: dict[Path, dict[str, Any]] = field(default_factory=dict)

    @cached_property
    def bound(self) -> BoundKnowledge:
        from nrdf.process.bound_knowledge import read_bound_knowledge

        return read_bound_knowledge(self.knowledge_file)

    @property
    def category(self) -> str:
        return self.bound.knowledge.category

    @cached_property
    def model(self) -> Model:
        import nrdf
        from nrdf.process.model_choice import model_name_for

        name = self.model_name or model_name_for(self.bound.knowledge)
        return nrdf.load_model(name, self.device)

    @cached_property
    def process_transfer(self) -> ProcessTransfer:
        from nrdf.process.transfer import ProcessTransfer

        with errors.status("reference"):
            return ProcessTransfer(self.bound, self.model)

    def transfer(self, target: Path, out: Path) -> None:
        """Write the job folder `out` of one target, and show what is in it.

        Raises NrdfError for what cannot be used; after writing, LimitError for a limit that is not
        met, and NothingFoundError where no tool path could be planned.
        """
        from nrdf.io.output import check_inputs, output_folder

        inputs = [self.knowledge_file, target, *self.region_files, self.model_name]
        with output_folder(out, self.overwrite, inputs) as folder:
            from nrdf.process.bound_knowledge import files_of
            from nrdf.reports.job_folder import write_job_files

            check_inputs(out, files_of(self.bound.knowledge, self.knowledge_file.parent))
            result, scan = self._transfer_to(target)
            origin = {
                "command": command_line(),
                "knowledge": str(self.knowledge_file),
                "target": str(target),
                **({} if scan is None else {"alignment": describe_alignment(scan)}),
                "model": provenance(self.model.metadata),
                "versions": versions(),
            }
            with errors.status("report"):
                report = write_job_files(folder, result, self.limits, target.name, origin)
        self.reports[out] = report
        show_transfer(report)
        console.print(f"{_summary(report)}; all in {out}")
        self._check(report)

    def _transfer_to(self, target: Path) -> tuple[TransferResult, AlignedScan | None]:
        """The transfer to one target, and the scan that the target is, if it is one."""
        import nrdf
        from nrdf.process.bound_knowledge import unit_and_warnings
        from nrdf.process.transfer_result import MIN_CONFIDENCE

        cloud: Any
        scan, kind, unscanned = None, None, None
        if self.scan.up is None:
            cloud = nrdf.read_cloud(target, topic=self.scan.topic)
            unit, warnings = unit_and_warnings(
                cloud, self.scan.unit, self.category, str(target), "--unit"
            )
            said: str | None = unit
        else:
            with errors.status("alignment"):
                examples = alignment_examples(self.model, self.bound.cloud)
                scan = read_scan(self.model, target, self.scan, examples)
            unit, guessed = _scan_unit(scan, target)
            warnings, kind, said = [*guessed, *scan.warnings], scan.kind, None
            cloud, unscanned = scan.encode_in_metres(unit), scan.unthinned_in_metres(unit)
        transfer = self.process_transfer
        marked = _marked(self.region_files, unit)
        least = MIN_CONFIDENCE if self.min_confidence is None else self.min_confidence
        with errors.status("regions and tool paths"):
            result = transfer.transfer(
                cloud, said, least, marked, target_warnings=warnings, whole=unscanned, kind=kind
            )
        return result, scan

    def _check(self, report: dict[str, Any]) -> None:
        from nrdf.errors import LimitError, NothingFoundError

        if not report["total"]["paths"]:
            raise NothingFoundError(_nothing_planned(report, self.category, self.scan.up))
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
    reasons = {f"region '{p['region']}': {p['reason']}": None for p in report["paths"]}
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


def _marked(files: tuple[Path, ...], unit: str) -> dict[str, Any]:
    """Regions that a person has marked on the target, points in metres."""
    from nrdf.geometry.units import METRES
    from nrdf.regions.files import read_regions

    found = read_regions(files, unit) if files else {}
    return {n: v if v.ndim == 1 else v * METRES[unit] for n, v in found.items()}


def _scan_unit(scan: AlignedScan, target: Path) -> tuple[str, list[str]]:
    """The scan's unit, and warnings about it beyond the scan's own.

    Raises ProcessError unless it is given or only one is plausible.
    """
    from nrdf.errors import ProcessError
    from nrdf.geometry.units import METRES

    unit = scan.unit
    if unit.name is None or (unit.origin == "guessed" and unit.warning):
        why = f" ({unit.warning})" if unit.warning else ""
        raise ProcessError(
            f"{target} does not say its unit{why}: give --unit ({', '.join(METRES)})"
        )
    if unit.origin != "guessed":
        return unit.name, []
    said = f"{target} does not say its unit; taken to be {unit.name}, from the object's size"
    return unit.name, [said]


def _summary(report: dict[str, Any]) -> str:
    total = report["total"]
    minutes, seconds = divmod(round(total["cycle_time_s"]), 60)
    return f"{total['paths']} tool paths, {minutes} min {seconds} s"
