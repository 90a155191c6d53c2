"""One transfer to many objects: the task of each, and what is known from an earlier run."""

from __future__ import annotations

import hashlib
import json
import os
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from nrdf.errors import NrdfError
from nrdf.io.files import sha256_of
from nrdf.io.result_folder import REPORT
from nrdf.process.limits import Limits
from nrdf.serve.object_transfer import ObjectTransfer, doubts
from nrdf.serve.scan_input import ScanOptions

MADE_FROM = "made_from"
"""Key of report.json: what a job was made from, to know one that need not be made again."""
NO_RESULT, DOUBTFUL, NOTHING = 2, 3, 4
"""Exit codes of `nrdf transfer`, for one object."""


@dataclass(frozen=True)
class TransferTask:
    """What all objects of one command share. command: as it was typed."""

    knowledge: Path
    model: str | None
    device: str
    scan: ScanOptions
    min_confidence: float | None
    limits: Limits
    strict: bool
    overwrite: bool
    command: str

    @property
    def objects(self) -> ObjectTransfer:
        """Knowledge, model and encoded reference, kept in each process."""
        file = self.knowledge
        changed = file.stat().st_mtime_ns if file.is_file() else 0
        return _objects(file, changed, self.model, self.device, self.scan, self.min_confidence)


@dataclass(frozen=True)
class TransferOutcome:
    """What became of one object. total: of its report, None where nothing was written; known: it
    was there already. warnings: how many; reasons: what speaks against it."""

    target: Path
    folder: Path
    exit_code: int
    reasons: tuple[str, ...] = ()
    total: dict[str, Any] | None = None
    known: bool = False


@lru_cache(maxsize=4)
def _objects(
    file: Path,
    mtime_ns: int,
    model: str | None,
    device: str,
    scan: ScanOptions,
    least: float | None,
) -> ObjectTransfer:
    return ObjectTransfer(file, model, device, scan, least)


def made_from(task: TransferTask, target: Path) -> dict[str, Any]:
    """What a job depends on: knowledge, target and options. Raises OSError."""
    options = {
        "model": task.model,
        "scan": asdict(task.scan),
        "min_confidence": task.min_confidence,
        "limits": asdict(task.limits),
    }
    return {
        "knowledge_sha256": _checksum(task.knowledge),
        "target_sha256": _checksum(target),
        "options": json.loads(json.dumps(options)),
    }


def transfer_one(task: TransferTask, pair: tuple[Path, Path]) -> TransferOutcome:
    """Write the job folder of one object, unless it is there already.

    pair: target and folder. Raises nothing that is foreseen.
    """
    from nrdf.io.output import output_folder

    target, folder = pair
    try:
        origin = made_from(task, target)
        known = _known(folder, origin)
        if known is not None and not task.overwrite:
            return _judged(task, target, folder, known, True)
        inputs = [task.knowledge, target, task.model]
        with output_folder(folder, task.overwrite, inputs) as place:
            objects = task.objects
            result, scan = objects.transfer(target)
            report = objects.write(
                place, target, result, scan, task.limits, task.command, {MADE_FROM: origin}
            )
        return _judged(task, target, folder, report, False)
    except (NrdfError, OSError) as error:
        return failed(pair, error)


def failed(pair: tuple[Path, Path], error: Exception) -> TransferOutcome:
    """What became of an object where that was an error. Raises one that nobody foresaw."""
    if isinstance(error, NrdfError):
        return TransferOutcome(*pair, error.exit_code, tuple(str(error).splitlines()))
    if isinstance(error, OSError):
        said = f"the system refused: {error.strerror or error}"
        return TransferOutcome(*pair, NO_RESULT, (said,))
    raise error


def _judged(
    task: TransferTask, target: Path, folder: Path, report: dict[str, Any], known: bool
) -> TransferOutcome:
    reasons = tuple(doubts(report, task.strict))
    code = DOUBTFUL if reasons else 0
    if not report["total"]["paths"]:
        code, reasons = NOTHING, ("no tool path could be planned", *reasons)
    return TransferOutcome(target, folder, code, reasons, report["total"], known)


def _known(folder: Path, origin: dict[str, Any]) -> dict[str, Any] | None:
    """The report of a job that was made from the same; None where there is none."""
    with suppress(OSError, ValueError):
        report = json.loads((folder / REPORT).read_text("utf-8"))
        whole = all((folder / name).is_file() for name in report["files"])
        if whole and report[MADE_FROM] == origin:
            return dict(report)
    return None


def _checksum(path: Path) -> str:
    """Of a file; of a folder (a ROS 2 bag) by names, sizes and times."""
    if path.is_dir():
        found = sorted((p.name, p.stat().st_size, p.stat().st_mtime_ns) for p in path.iterdir())
        return hashlib.sha256(os.fsencode(str(found))).hexdigest()
    with open(path, "rb") as file:
        return sha256_of(file)
