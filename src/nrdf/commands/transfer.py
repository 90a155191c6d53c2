"""`nrdf transfer`: process knowledge, transferred from its reference to new objects."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional

from nrdf.commands.console import command_line, console, errors, progress_bar, show, table
from nrdf.commands.options import Cluster, File, Folder, Metavar, Sensors, Skip, Unit, Up
from nrdf.errors import ConfigError
from nrdf.io.bounds import Bounds, Count, Fraction, NonNegative
from nrdf.tasks import Workers, chosen_workers, run_tasks

if TYPE_CHECKING:
    from nrdf.serve.many import TransferOutcome, TransferTask

_LARGEST_LIST = 1 << 30
_SEVERITY = (0, 3, 4, 2)  # exit codes, from good to bad: with 2 there is no result

Degrees = Annotated[float, Bounds(0.0, 180.0), Metavar("DEG")]
ShareOption = Annotated[Fraction, Metavar("SHARE")]


def transfer(
    knowledge: Positional[Annotated[Path, Metavar("KNOWLEDGE")]],
    target: Positional[Annotated[tuple[Path, ...], Metavar("TARGET [TARGET ...]")]] = (),
    targets_from: File | None = None,
    out: Folder | None = None,
    model: str | None = None,
    unit: Unit | None = None,
    up: Up | None = None,
    sensor: Sensors = (),
    skip: tuple[Skip, ...] = (),
    topic: str | None = None,
    region: tuple[File, ...] = (),
    min_confidence: ShareOption | None = None,
    min_coverage: ShareOption | None = None,
    max_line_spacing_mm: NonNegative | None = None,
    max_surface_distance_mm: NonNegative | None = None,
    max_axis_error_deg: Degrees | None = None,
    max_step_mm: NonNegative | None = None,
    max_turn_deg: Degrees | None = None,
    max_cycle_time_s: NonNegative | None = None,
    require_all: bool = False,
    any_kind: bool = False,
    strict: bool = False,
    device: str = "cpu",
    workers: Count | None = None,
    cluster: Cluster | None = None,
    overwrite: bool = False,
) -> int:
    """Bring process knowledge to new objects, as tool paths.

    Writes a job folder for each target: knowledge.yaml (the same format, for the new object),
    target.ply and regions/ (in metres), toolpaths.json (for `nrdf export`), report.json,
    report.html (opens without a network) and picture.png. A region that the new object lacks is
    reported and skipped.

    Ends with 3, after writing, where a limit that is set is not met, or the target looks like
    another kind of object, or one that lies or faces elsewhere; with 4 where no tool path could be
    planned. With several targets each is taken whatever becomes of the others, and the exit code is
    the worst of theirs: 2 (no result) before 4, 4 before 3, 3 before 0. A target whose job is there
    already, made from the same, is not done again: the same command goes on after an end. With
    --out, OUT/index.html and OUT/objects.csv show all, the most doubtful first.

    Example: nrdf transfer chair.yaml new.ply --min-coverage 0.98

    Args:
        knowledge: Knowledge file, as `nrdf teach` begins it.
        target: Cloud or mesh of a new object: +X forward, +Y up, or in any pose with --up. One or
            more.
        targets_from: File with more targets, a path a line: more than a command line holds.
        out: Folder to write, job-NAME unless given, by the target's name; with several targets the
            folder of their folders.
        model: Zoo name, weight file or run, such as general or registration, which serve any
            category; what the knowledge says, or the category's own, unless given.
        unit: Of the target's file, where it does not say.
        up: The target is a scan, to be cleaned and aligned first, as by `nrdf align`; direction in
            it that points up: x, y, z, -x, -y, -z, or 'x y z', or auto.
        sensor: Where the scan's sensors stood: x y z of each. The file may say so as well.
        skip: Steps of cleaning the scan to leave out.
        topic: What to read of a ROS 2 bag that has clouds under several topics.
        region: Region files of the one target, marked by hand, named after taught regions: they are
            taken instead of what is found.
        min_confidence: Regions found with less mean confidence are skipped; 0.25 unless given.
        min_coverage: Limit on the share of each whole region, as it was found, that its tool works,
            0 to 1.
        max_line_spacing_mm: Limit on the distance between neighbouring lines.
        max_surface_distance_mm: Limit on the distance of what is worked from the object as given:
            from the mesh itself, or from the surface between all of a cloud's points.
        max_axis_error_deg: Limit on the tool axis' error, of 99 % of the waypoints.
        max_step_mm: Limit on the step between neighbouring waypoints of a line.
        max_turn_deg: Limit on the turn of the tool's axis between neighbouring waypoints of a line.
        max_cycle_time_s: Limit on the time of all tool paths of a target together.
        require_all: Limit: every process of every region must have a tool path.
        any_kind: Take a target that does not look like the knowledge's kind of object, upright and
            facing +X, with a warning; without, it is a limit that is not met.
        strict: Limit: nothing may be doubtful about the target's pose, unit and kind, and about
            its regions, absent ones included.
        device: cpu, cuda, cuda:N or auto.
        workers: Processes that work on several targets, one unless given; more need nrdf[cluster].
        cluster: Address of a Dask scheduler that does so instead: tcp://host:8786.
        overwrite: Replace an earlier result in the output folder.
    """
    from nrdf.commands.transfer_run import TransferRun
    from nrdf.process.limits import Limits
    from nrdf.serve.many import TransferTask
    from nrdf.serve.object_transfer import ObjectTransfer
    from nrdf.serve.scan_input import ScanOptions
    from nrdf.serve.summary import write_catalogue

    limits = Limits(
        min_coverage=min_coverage,
        max_line_spacing_m=_scaled(max_line_spacing_mm, 1e-3),
        max_surface_distance_m=_scaled(max_surface_distance_mm, 1e-3),
        max_axis_error_rad=_scaled(max_axis_error_deg, math.pi / 180),
        max_step_m=_scaled(max_step_mm, 1e-3),
        max_turn_rad=_scaled(max_turn_deg, math.pi / 180),
        max_cycle_time_s=max_cycle_time_s,
        require_all=require_all,
        any_kind=any_kind,
    )
    scan = ScanOptions(up, sensor, unit, skip, topic)
    scan.refuse_without_up("sensor", "skip")
    if region and (len(target) > 1 or targets_from is not None):
        raise ConfigError("--region marks regions of one target; give one target")
    if targets_from is not None:
        target = (*target, *listed_targets(targets_from))
    folders = job_folders(target, out)
    if len(target) == 1 and cluster is None:
        objects = ObjectTransfer(knowledge, model, device, scan, min_confidence)
        TransferRun(objects, region, limits, strict, overwrite).transfer(target[0], folders[0])
        return 0
    task = TransferTask(
        knowledge, model, device, scan, min_confidence, limits, strict, overwrite, command_line()
    )
    outcomes = _transfer_many(
        task, list(zip(target, folders, strict=True)), chosen_workers(workers, cluster, 1)
    )
    show_outcomes(outcomes)
    if out is not None and len(target) > 1:
        write_catalogue(out, outcomes, knowledge.stem)
        console.print(f"all in {out}; {out}/index.html shows them")
    return max((outcome.exit_code for outcome in outcomes), key=_SEVERITY.index)


def _transfer_many(
    task: TransferTask, pairs: list[tuple[Path, Path]], workers: Workers
) -> list[TransferOutcome]:
    """What becomes of each target, in their order; a line each as they come."""
    from nrdf.serve.many import failed, transfer_one

    task.objects.process_transfer  # noqa: B018  knowledge that is wrong is so for every target
    found: dict[tuple[Path, Path], TransferOutcome] = {}
    with progress_bar("targets") as progress:
        for pair, came in run_tasks(partial(transfer_one, task), pairs, workers):
            if isinstance(came, Exception):
                came = failed(pair, came)
            found[pair] = came
            progress(len(found), len(pairs))
            style = None if came.exit_code == 0 else "yellow"
            for reason in came.reasons or ("made before" if came.known else "good",):
                errors.print(f"{came.target}: {reason}", style=style)
    return [found[pair] for pair in pairs]


def listed_targets(file: Path) -> list[Path]:
    """The paths in a file, one a line. Raises ConfigError for one that cannot be read."""
    from nrdf.io.files import read_file

    text = read_file(file, ConfigError, _LARGEST_LIST).decode("utf-8-sig", "surrogateescape")
    return [Path(line.strip()) for line in text.splitlines() if line.strip()]


def job_folders(targets: Sequence[Path], out: Path | None) -> list[Path]:
    """The folder of each target's job: job-NAME, or `out`, or, of several, NAME in `out`.

    Raises ConfigError without a target, and where two would have the same folder.
    """
    if not targets:
        raise ConfigError("nrdf transfer needs a TARGET\nsee nrdf transfer --help")
    if out is not None and len(targets) == 1:
        return [out]
    folders: dict[str, Path] = {}
    for target in targets:
        name = target.stem.casefold()  # some file systems know no capitals
        if name in folders:
            raise ConfigError(
                f"two targets are called '{target.stem}', and would share a folder: rename one, "
                "or give them one by one"
            )
        folders[name] = Path(f"job-{target.stem}") if out is None else out / target.stem
    return list(folders.values())


def show_outcomes(outcomes: Sequence[TransferOutcome]) -> None:
    """A table of several targets, and what became of each."""
    words = {0: "good", 2: "no result", 3: "a limit is not met", 4: "nothing planned"}
    shown = table("\nall targets", "target", "tool paths", "skipped", "time, s", "", "")
    for one in outcomes:
        total = one.total
        cells = (
            ["–"] * 3
            if total is None
            else [str(total["paths"]), str(total["skipped"]), f"{total['cycle_time_s']:.0f}"]
        )
        style = None if one.exit_code == 0 else "yellow"
        where = "" if total is None else str(one.folder)
        shown.add_row(str(one.target), *cells, words[one.exit_code], where, style=style)
    show(shown)


def _scaled(value: float | None, factor: float) -> float | None:
    return None if value is None else value * factor
