"""One object after another with the same knowledge and model; the reference is encoded once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from nrdf.process.limits import Limits
from nrdf.reports.origin import origin_of
from nrdf.serve.scan_input import ScanOptions, alignment_examples, describe_alignment, read_scan

if TYPE_CHECKING:
    from nrdf.process.bound_knowledge import BoundKnowledge
    from nrdf.process.transfer import ProcessTransfer
    from nrdf.process.transfer_result import TransferResult
    from nrdf.regions.model import Model
    from nrdf.scans.aligned_scan import AlignedScan

Progress = Callable[[str], None]


def _silent(what: str) -> None:
    return None


@dataclass
class ObjectTransfer:
    """Knowledge, model and encoded reference, read when the first object needs them.

    min_confidence: regions found with less are skipped; the usual unless given.
    """

    knowledge_file: Path
    model_name: str | None = None
    device: str = "cpu"
    scan: ScanOptions = field(default_factory=lambda: ScanOptions(None))
    min_confidence: float | None = None

    @cached_property
    def bound(self) -> BoundKnowledge:
        from nrdf.process.bound_knowledge import read_bound_knowledge

        return read_bound_knowledge(self.knowledge_file)

    @property
    def category(self) -> str:
        return self.bound.knowledge.category

    @cached_property
    def model(self) -> Model:
        from nrdf.process.model_choice import model_name_for
        from nrdf.regions.model import load_model

        return load_model(self.model_name or model_name_for(self.bound.knowledge), self.device)

    @cached_property
    def process_transfer(self) -> ProcessTransfer:
        from nrdf.process.transfer import ProcessTransfer

        return ProcessTransfer(self.bound, self.model)

    def transfer(
        self, target: Path, region_files: Sequence[Path] = (), progress: Progress = _silent
    ) -> tuple[TransferResult, AlignedScan | None]:
        """The transfer to one object, and the scan that it is, if it is one.

        region_files: regions that a person has marked on it. Raises NrdfError for what cannot be
        used.
        """
        from nrdf.io.cloud import read_cloud
        from nrdf.process.bound_knowledge import unit_and_warnings
        from nrdf.process.transfer_result import MIN_CONFIDENCE

        progress("reference")
        transfer = self.process_transfer
        cloud: Any
        scan, kind, unscanned = None, None, None
        if self.scan.up is None:
            cloud = read_cloud(target, topic=self.scan.topic)
            unit, warnings = unit_and_warnings(
                cloud, self.scan.unit, self.category, str(target), "--unit"
            )
            said: str | None = unit
        else:
            progress("alignment")
            examples = alignment_examples(self.model, self.bound.cloud)
            scan = read_scan(self.model, target, self.scan, examples)
            unit, guessed = _scan_unit(scan, target)
            warnings, kind, said = [*guessed, *scan.warnings], scan.kind, None
            cloud, unscanned = scan.encode_in_metres(unit), scan.unthinned_in_metres(unit)
        marked = _marked(region_files, unit)
        least = MIN_CONFIDENCE if self.min_confidence is None else self.min_confidence
        progress("regions and tool paths")
        result = transfer.transfer(
            cloud, said, least, marked, target_warnings=warnings, whole=unscanned, kind=kind
        )
        return result, scan

    def write(
        self,
        folder: Path,
        target: Path,
        result: TransferResult,
        scan: AlignedScan | None,
        limits: Limits,
        command: str,
        more: Mapping[str, Any] = MappingProxyType({}),
    ) -> dict[str, Any]:
        """Write a transfer's job into an existing folder; what its report.json says, `more` too."""
        from nrdf.reports.job_folder import write_job_files

        alignment = None if scan is None else describe_alignment(scan)
        origin = origin_of(
            command, str(self.knowledge_file), str(target), self.model.metadata, alignment
        )
        return write_job_files(folder, result, limits, target.name, {**origin, **more})


def doubts(report: dict[str, Any], strict: bool) -> list[str]:
    """What speaks against a job, by its report: limits not met and, where strict, warnings."""
    return [*report["limits"]["not_met"], *(report["strict_warnings"] if strict else [])]


def reasons_for_nothing(report: dict[str, Any]) -> list[str]:
    """Why a transfer has no tool path at all, region by region."""
    reasons = {f"region '{p['region']}': {p['reason']}": None for p in report["paths"]}
    return list(reasons)


def _marked(files: Sequence[Path], unit: str) -> dict[str, Any]:
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
