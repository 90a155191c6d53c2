"""What a worker does with one object: transfer, programs, simulation, a judgement."""

from __future__ import annotations

import logging
import time
import traceback
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from typing import Any

from nrdf.cell.file import read_cell
from nrdf.cell.placement import place_job
from nrdf.cell.rules import KnowledgeChoice, choose_knowledge, read_choices
from nrdf.cell.work_cell import WorkCell
from nrdf.errors import CloudError, LimitError, NrdfError, OutputError
from nrdf.export.options import options_of_cell
from nrdf.export.registry import export_job
from nrdf.io.result_folder import write_manifest
from nrdf.serve.object_transfer import ObjectTransfer, doubts, reasons_for_nothing
from nrdf.serve.outbox import write_object
from nrdf.serve.scan_input import ScanOptions
from nrdf.serve.store import ObjectRow, Outcome
from nrdf.serve.summary import figures_of
from nrdf.toolpath.file import read_toolpaths

log = logging.getLogger(__name__)

PROGRAMS, SIMULATION = "programs", "simulation"
_COMMAND = "nrdf run"


@dataclass(frozen=True)
class Judgement:
    """What became of an object. again: nothing did, for a reason that is not its own (a full disk);
    it is to wait."""

    outcome: Outcome
    reason: str
    figures: dict[str, Any] = field(default_factory=dict)
    again: bool = False


@dataclass
class ObjectWork:
    """A cell, its knowledge files and their encoded references: read once a worker."""

    cell: WorkCell
    folder: Path
    choices: list[KnowledgeChoice]
    _transfers: dict[Path, ObjectTransfer] = field(default_factory=dict)

    @staticmethod
    def of(cell_file: Path) -> ObjectWork:
        """For a cell file. Raises ProcessError."""
        cell = read_cell(cell_file)
        return ObjectWork(cell, cell_file.parent, read_choices(cell, cell_file.parent))

    def judge(self, row: ObjectRow, work: Path) -> Judgement:
        """Write an object's folder at `work`, and say what becomes of it. Raises nothing."""
        began = time.process_time()
        figures: dict[str, Any] = {}
        try:
            work.mkdir(parents=True)
            outcome, reasons, figures = self._done(row, work)
        except OutputError as error:
            return Judgement("refused", str(error), again=True)
        except NrdfError as error:
            outcome, reasons = "refused", str(error).splitlines()
        except (OSError, MemoryError) as error:
            return Judgement("refused", f"the system refused: {error}", again=True)
        except Exception as error:  # a line goes on, whatever one object finds wrong in us
            log.debug("%s", traceback.format_exc())
            reasons = [f"an error in nrdf: {type(error).__name__}: {error}", traceback.format_exc()]
            outcome = "refused"
        figures = {**figures, "cpu_s": round(time.process_time() - began, 3)}
        try:
            reason = write_object(work, row, outcome, reasons, figures)
            write_manifest(work)
        except (OutputError, OSError) as error:
            return Judgement("refused", str(error), again=True)
        return Judgement(outcome, reason, figures)

    def _done(self, row: ObjectRow, work: Path) -> tuple[Outcome, list[str], dict[str, Any]]:
        _require_unchanged(row)
        limits = self.cell.limits
        choice = choose_knowledge(self.choices, PurePath(row.label))
        transfer = self._transfer_for(choice)
        result, scan = transfer.transfer(Path(row.source))
        report = transfer.write(work, Path(row.source), result, scan, limits.limits, _COMMAND)
        figures = figures_of(report)
        if not report["total"]["paths"]:
            nothing = ["no tool path could be planned", *reasons_for_nothing(report)]
            return limits.otherwise, nothing, figures
        reasons = doubts(report, limits.strict)
        try:
            self._write_programs(work)
        except LimitError as error:
            reasons += str(error).splitlines()
        if self.cell.line.simulate and not reasons:
            reasons += self._simulated(work, row.name, figures)
        return (limits.otherwise if reasons else "done"), reasons, figures

    def _transfer_for(self, choice: KnowledgeChoice) -> ObjectTransfer:
        scans = self.cell.scans
        sensors = tuple(x for sensor in scans.sensors for x in sensor)
        options = ScanOptions(scans.up, sensors if scans.up else (), scans.unit)
        return self._transfers.setdefault(
            choice.file,
            ObjectTransfer(
                choice.file, scan=options, min_confidence=self.cell.limits.min_confidence
            ),
        )

    def _write_programs(self, work: Path) -> None:
        placed = place_job(self.cell, read_toolpaths(work), work)
        options = options_of_cell(self.cell)
        export_job(placed, self.cell.programs.formats, work / PROGRAMS, options)

    def _simulated(self, work: Path, name: str, figures: dict[str, Any]) -> list[str]:
        """Simulate a job, and say what speaks against it."""
        from nrdf.robot.report.folder import write_simulation
        from nrdf.robot.simulation.described_cell import simulate_in_cell
        from nrdf.robot.simulation.job import read_simulation_job

        result = simulate_in_cell(self.cell, self.folder, read_simulation_job(work))
        folder = work / SIMULATION
        folder.mkdir()
        total = write_simulation(folder, result, name, {}, False, False)["total"]
        figures |= {"reached": total["reached_share"], "simulated_s": round(total["time_s"], 1)}
        reasons = []
        if total["collisions"]:
            reasons.append(f"simulation: {total['collisions']} moves with a collision")
        if total["reached_share"] < 1.0:
            share = total["reached_share"]
            reasons.append(f"simulation: {share:.1%} of the waypoints are reached, not all")
        return reasons


def _require_unchanged(row: ObjectRow) -> None:
    """Raise CloudError where an object's file is not the one that arrived."""
    try:
        known = Path(row.source).stat()
    except OSError as error:
        raise CloudError(f"the file {row.source} cannot be read: {error.strerror}") from None
    if (known.st_size, known.st_mtime_ns) != (row.bytes, row.mtime_ns):
        raise CloudError(
            f"the file {row.source} has changed since it arrived; what it is now counts as another "
            "object"
        )
