"""`nrdf transfer`: process knowledge, taken from the object it was taught on to a new one."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from tyro.conf import Positional

from nrdf.commands.align import Skip, Unit, describe_alignment, read_scan, stand_ins
from nrdf.commands.console import command_line, console, errors, provenance, show, table, versions
from nrdf.io.bounds import Bounds, Fraction, NonNegative

_NAME_WIDTH = 12  # characters

if TYPE_CHECKING:
    from nrdf.field.encoded_cloud import EncodedCloud
    from nrdf.io.cloud import PointCloud
    from nrdf.scans.aligned_scan import AlignedScan


def transfer(
    knowledge: Positional[Path],
    target: Path,
    out: Path,
    model: str | None = None,
    unit: Unit | None = None,
    up: str | None = None,
    sensor: tuple[float, ...] = (),
    skip: tuple[Skip, ...] = (),
    topic: str | None = None,
    region: tuple[Path, ...] = (),
    min_confidence: Fraction | None = None,
    min_coverage: Fraction | None = None,
    max_line_spacing_mm: NonNegative | None = None,
    max_surface_distance_mm: NonNegative | None = None,
    max_axis_error_deg: Annotated[float, Bounds(0.0, 180.0)] | None = None,
    max_step_mm: NonNegative | None = None,
    max_turn_deg: Annotated[float, Bounds(0.0, 180.0)] | None = None,
    max_cycle_time_s: NonNegative | None = None,
    require_all: bool = False,
    any_kind: bool = False,
    strict: bool = False,
    device: str = "cpu",
    overwrite: bool = False,
) -> None:
    """Bring process knowledge to a new object, as tool paths.

    Writes into the output folder: knowledge.yaml (the same format, for the new object),
    target.ply and regions/ (in metres), toolpaths.json (for `nrdf export`), report.json,
    report.html (opens without a network) and picture.png. A region that the new object lacks is
    reported and skipped. Ends, after writing, with 4 where no tool path could be planned, and
    with 3 where a limit that is set is not met, or the target looks like another kind of object,
    or one that lies or faces elsewhere.

    Example: nrdf transfer chair.yaml --target new.ply --out job/ --min-coverage 0.98

    Args:
        knowledge: Knowledge file, as `nrdf knowledge new` begins it.
        target: Cloud or mesh of the new object: +X forward, +Y up, or in any pose with --up.
        out: Folder to write; made if missing.
        model: Zoo name, weight file or run; the category's model in the zoo unless given.
        unit: Of the target's file, where it does not say: m, cm, mm or in.
        up: The target is a scan, to be cleaned and aligned first, as by `nrdf align`; direction in
            it that points up: x, y, z, -x, -y, -z, or 'x y z', or auto.
        sensor: Where the scan's sensors stood: x y z of each. The file may say so as well.
        skip: Steps of cleaning the scan to leave out.
        topic: What to read of a ROS 2 bag that has clouds under several topics.
        region: Region files of the target, marked by hand, named after taught regions: they are
            taken instead of what is found.
        min_confidence: Regions found with less mean confidence are skipped (0.25).
        min_coverage: Limit on the share of each whole region, as it was found, that its tool works,
            0 to 1.
        max_line_spacing_mm: Limit on the distance between neighbouring lines.
        max_surface_distance_mm: Limit on the distance of what is worked from the object as given:
            from the mesh itself, or from the surface between all of a cloud's points.
        max_axis_error_deg: Limit on the tool axis' error, of 99 % of the waypoints.
        max_step_mm: Limit on the step between neighbouring waypoints of a line.
        max_turn_deg: Limit on the turn of the tool's axis between neighbouring waypoints of a line.
        max_cycle_time_s: Limit on the time of all tool paths together.
        require_all: Limit: every process of every region must have a tool path.
        any_kind: Take a target that does not look like the knowledge's kind of object, upright and
            facing +X, with a warning; without, it is a limit that is not met.
        strict: Limit: nothing may be doubtful about the target's pose, unit and kind, and about
            its regions, absent ones included.
        device: cpu, cuda, cuda:N or auto.
        overwrite: Replace an earlier result in the output folder.
    """
    import math

    from nrdf.errors import CloudError, LimitError, NothingFoundError
    from nrdf.io.output import check_inputs, output_folder
    from nrdf.process.limits import Limits

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
    if up is None and (sensor or skip):
        raise CloudError("--sensor and --skip are for scans: give --up")
    with output_folder(out, overwrite, [knowledge, target, *region, model]) as folder:
        import nrdf
        from nrdf.process.bound_knowledge import files_of, read_bound_knowledge, unit_and_warnings
        from nrdf.process.transfer import ProcessTransfer
        from nrdf.process.transfer_result import MIN_CONFIDENCE
        from nrdf.reports.job_folder import write_job_files

        lesson = read_bound_knowledge(knowledge)
        check_inputs(out, files_of(lesson.knowledge, knowledge.parent))
        category = lesson.knowledge.category
        loaded = nrdf.load_model(model or category, device)
        scan = None
        if up is None:
            cloud = nrdf.read_cloud(target, topic=topic)
            known, doubts = unit_and_warnings(cloud, unit, category, str(target), "--unit")
        else:
            with errors.status("alignment"):
                examples = stand_ins(loaded, lesson.cloud)
                scan = read_scan(loaded, target, up, sensor, unit, skip, topic, examples)
            known, guessed = _scan_unit(scan, target)
            doubts = [*guessed, *scan.warnings]
        with errors.status("reference"):
            teacher = ProcessTransfer(lesson, loaded)
        marked = _marked(region, known)
        with errors.status("regions and tool paths"):
            least = MIN_CONFIDENCE if min_confidence is None else min_confidence
            given, said, whole = (cloud, known, None) if scan is None else _of_scan(scan, known)
            kind = None if scan is None else scan.kind
            transferred = teacher.transfer(
                given, said, least, marked, target_warnings=doubts, whole=whole, kind=kind
            )
        origin = {
            "command": command_line(),
            "knowledge": str(knowledge),
            "target": str(target),
            **({} if scan is None else {"alignment": describe_alignment(scan)}),
            "model": provenance(loaded.metadata),
            "versions": versions(),
        }
        with errors.status("report"):
            report = write_job_files(folder, transferred, limits, target.name, origin)
    show_transfer(report)
    console.print(f"{_summary(report)}; all in {out}")
    if not report["total"]["paths"]:
        raise NothingFoundError(_nothing_planned(report, category, up))
    broken, doubted = report["limits"]["not_met"], report["strict_warnings"] if strict else []
    if broken or doubted:
        parts = (("limits not met", broken), ("doubtful, with --strict", doubted))
        lines = [line for title, of in parts if of for line in (f"{title}:", *_indented(of))]
        raise LimitError("\n".join(lines))


def _of_scan(scan: AlignedScan, unit: str) -> tuple[EncodedCloud, None, PointCloud]:
    """A scan as `ProcessTransfer.transfer` takes it: embedded in metres, and all of its points."""
    return scan.encode_in_metres(unit), None, scan.unthinned_in_metres(unit)


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
    """The scan's unit, and what is doubtful about it beyond the scan's own doubts.

    Raises ProcessError unless it is given or only one is plausible.
    """
    from nrdf.errors import ProcessError
    from nrdf.geometry.units import METRES

    unit = scan.unit
    if unit.name is None or (unit.origin == "guessed" and unit.doubt):
        why = f" ({unit.doubt})" if unit.doubt else ""
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


def _scaled(value: float | None, factor: float) -> float | None:
    return None if value is None else value * factor
