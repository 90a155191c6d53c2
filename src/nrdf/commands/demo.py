"""`nrdf demo`: five regions of a bundled chair, each with a process, brought to four others."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nrdf.commands.console import (
    command_line,
    console,
    errors,
    progress_bar,
    provenance,
    show,
    table,
    versions,
    write_report,
)
from nrdf.commands.demo_new_kind import FOLDER, KIND, overlap, transfer_new_kind
from nrdf.commands.options import Folder

if TYPE_CHECKING:
    import numpy as np

    from nrdf.process.transfer import ProcessTransfer
    from nrdf.process.transfer_result import TransferResult

EXPORTED = ("urscript", "csv")
SCAN_YAW, SCAN_PLACE_M = 2.1, (1.2, -0.7, 0.45)
"""How the real chair stands in its scan, +Z up: about up (rad), and its origin."""
SCAN_PIXELS, SCAN_NOISE_M = 260, 0.0005
TRUE_MESH = "true-mesh.ply"
"""The real chair as it is: what its scan and its paths are judged by."""
"""Of each of its eight cameras; about 200,000 points on the chair."""


def demo(
    out: Folder = Path("demo"),
    model: str = "chair",
    device: str = "cpu",
    no_arm: bool = False,
    overwrite: bool = False,
) -> None:
    """Bring a bundled chair's five processes to four other chairs.

    The paper's demonstration (Fig. 6): five regions are taught on one chair, each with a strategy
    of its own; they are found on four others, where tool paths are planned, measured and written
    for a robot. The first is a real chair, scanned in an unknown pose by eight simulated cameras:
    its scan is cleaned and aligned, its tool paths are planned on the scan, measured against its
    true mesh, and run on a simulated arm that meets the true mesh. The others are members of the
    parametric family that no training set holds, so their true regions are known exactly; the
    table shows found against true. Last, a table, a kind without a model of its own, has its top
    painted: the general model finds it.

    Example: nrdf demo --out demo --overwrite

    Args:
        out: Folder to write; made if missing.
        model: Zoo name, weight file or run of the category chair.
        device: cpu, cuda, cuda:N or auto.
        no_arm: Leave out the real chair's job on the simulated arm, which takes a minute.
        overwrite: Replace an earlier demo in the output folder.
    """
    from nrdf.bundled import REAL, REFERENCE
    from nrdf.io.output import output_folder

    with output_folder(out, overwrite, [model]) as folder:
        results = _run(folder, model, device)
        simulated = _simulate(folder) if not no_arm else None
        other = transfer_new_kind(folder, {"command": command_line(), "versions": versions()})
    _show(results)
    console.print(
        f"{REAL}: a real chair, scanned in an unknown pose. off mesh: 99 % of what its tool paths "
        "work lies within that of its true mesh, which no planning has seen"
    )
    first = f"{out}/{REAL}"
    if simulated is not None:
        from nrdf.commands.simulate import show_simulation

        console.print(f"\n{REAL} on the bundled arm, in simulation:")
        show_simulation(simulated)
        console.print(f"{first}/simulation/report.html shows it, with a film")
    console.print(
        f"\n{out}/{FOLDER}: {other.note}. The top of a {KIND}, taught on another {KIND}: IoU with "
        f"the true one {other.iou:.2f}, {_or_dash(other.coverage, '.0%')} of it painted, planned "
        f"in {other.seconds:.1f} s; picture.png shows it"
    )
    console.print(
        f"\npicture and report in {out}; for each chair a job: {first}/report.html shows it.\n"
        f"Next, for instance, change {out}/chair.yaml, then\n"
        f"nrdf check {out}/chair.yaml\n"
        f"nrdf transfer {out}/chair.yaml {first}.ply --up z\n"
        f"nrdf export job-{REAL} --format rapid noether\n"
        f"or only find regions: nrdf retrieve --model {model} --reference {out}/{REFERENCE}.ply "
        f"--region {out}/{REFERENCE}/seat.ply --target {first}.ply --up z"
    )


@dataclass(frozen=True)
class Found:
    """One region on one chair: points found and true, intersection over union (None where the truth
    is not known), confidence, and the tool path's coverage, seconds, and distance from the true
    mesh (None where there is no path, or no mesh)."""

    chair: str
    region: str
    process: str
    found: int
    true: int | None
    iou: float | None
    confidence: float
    coverage: float | None
    cycle_time_s: float | None
    true_distance_99_m: float | None


def _run(folder: Path, model: str, device: str) -> list[Found]:
    import nrdf
    from nrdf.bundled import REAL, REFERENCE, TARGETS, bundled_chair
    from nrdf.export.registry import export_job
    from nrdf.process.limits import Limits
    from nrdf.process.transfer import ProcessTransfer
    from nrdf.reports.job_folder import job_of, panel_of, panel_of_reference, write_job_files
    from nrdf.viz.picture import draw_regions

    loaded = nrdf.load_model(model, device)
    origin = {
        "command": command_line(),
        "model": provenance(loaded.metadata),
        "versions": versions(),
    }
    with progress_bar("chairs") as progress:
        every = (REAL, *TARGETS)
        progress(0, len(every) + 1)
        process_transfer = ProcessTransfer(_write_knowledge(folder), loaded)
        panels = [panel_of_reference(process_transfer, REFERENCE)]
        results: list[Found] = []
        for done, chair in enumerate(every, 1):
            progress(done, len(every) + 1)
            truth: dict[str, np.ndarray] = {}
            if chair == REAL:
                result = _from_scan(folder, process_transfer)
            else:
                target, truth = bundled_chair(chair)
                nrdf.write_cloud(folder / f"{chair}.ply", target)
                result = process_transfer.transfer(target)
            found = _compare(chair, result, truth)
            results += found
            panels.append(panel_of(result, chair, _note(found, result)))
            (folder / chair).mkdir()
            write_job_files(folder / chair, result, Limits(), chair, origin)
            export_job(job_of(result), EXPORTED, folder / chair / "export")
        progress(len(every) + 1, len(every) + 1)
    draw_regions(panels, folder / "picture.png")
    write_report(folder, {**origin, "unit": "m", "found": [vars(row) for row in results]})
    return results


def _from_scan(folder: Path, process_transfer: ProcessTransfer) -> TransferResult:
    """The real chair: scanned, aligned, and worked; measured against its true mesh."""
    import numpy as np

    from nrdf.bundled import REAL, bundled_mesh
    from nrdf.geometry.canonical import rotation_about_up
    from nrdf.geometry.similarity import Similarity, up_axis, upright
    from nrdf.io.cloud import write_cloud
    from nrdf.io.ply import write_ply_mesh
    from nrdf.scans.aligned_scan import clean_and_align
    from nrdf.scans.pose_scorer import PoseScorer
    from nrdf.scans.simulate import ScanSettings, simulate_scan
    from nrdf.surface.given_surface import MeshSurface

    mesh = bundled_mesh()
    turn = upright(up_axis("z")) @ rotation_about_up(SCAN_YAW)
    pose = Similarity(turn, np.array(SCAN_PLACE_M), 1.0)
    settings = ScanSettings(views=8, pixels=SCAN_PIXELS, noise=SCAN_NOISE_M, floor=True)
    rng = np.random.default_rng(0)
    scan = simulate_scan(mesh.vertices, mesh.faces, settings, rng, pose, unit="m")
    write_cloud(folder / f"{REAL}.ply", scan.cloud)
    aligned = clean_and_align(PoseScorer(process_transfer.model), scan.cloud)
    encoded = aligned.encode_in_metres("m")
    # Not a part of the cloud: paths would be planned on it.
    vertices = scan.pose.to_scan(mesh.vertices)
    write_ply_mesh(folder / TRUE_MESH, vertices, mesh.faces, ["unit m"])
    return process_transfer.transfer(
        encoded,
        target_warnings=aligned.warnings,
        kind=aligned.kind,
        given=MeshSurface(vertices, mesh.faces),
    )


def _simulate(folder: Path) -> dict[str, Any] | None:
    """The real chair's job on the bundled arm; None where MuJoCo is not installed."""
    from importlib.util import find_spec

    from nrdf.bundled import REAL

    if find_spec("mujoco") is None:
        errors.print("no arm: pip install 'nrdf[robot]' for the simulation", style="yellow")
        return None
    from nrdf.errors import NrdfError
    from nrdf.robot.model.arm import load_arm
    from nrdf.robot.model.signed_distance import distance_field_from_file
    from nrdf.robot.report.folder import write_simulation
    from nrdf.robot.simulation.job import read_simulation_job
    from nrdf.robot.simulation.simulate import simulate

    job = folder / REAL
    try:
        with errors.status("the arm") as status:
            work = read_simulation_job(job)
            field = distance_field_from_file(folder / TRUE_MESH, work.points)
            work = work.with_mesh(folder / TRUE_MESH)
            done = simulate(work, load_arm(), field, progress=status.update)
    except NrdfError as error:  # the demonstration so far is worth keeping
        errors.print(f"no arm: {error}", style="yellow")
        return None
    (job / "simulation").mkdir()
    origin = {"command": command_line(), "versions": versions()}
    with progress_bar("pictures") as progress:
        return write_simulation(job / "simulation", done, REAL, origin, progress=progress)


def _write_knowledge(folder: Path) -> Any:
    """The bundled knowledge with its reference and regions as files that a user may change."""
    from nrdf.bundled import KNOWLEDGE, REFERENCE
    from nrdf.io.cloud import write_cloud
    from nrdf.process.bound_knowledge import checksum, read_bound_knowledge
    from nrdf.process.knowledge import Reference
    from nrdf.process.knowledge_file import write_knowledge

    bound = read_bound_knowledge(KNOWLEDGE)
    write_cloud(folder / f"{REFERENCE}.ply", bound.cloud)
    (folder / REFERENCE).mkdir()
    regions = []
    for region in bound.knowledge.regions:
        file = f"{REFERENCE}/{region.name}.ply"
        write_cloud(folder / file, bound.cloud.select(bound.regions[region.name]))
        regions.append(region.model_copy(update={"file": file}))
    cloud = f"{REFERENCE}.ply"
    reference = Reference(cloud=cloud, sha256=checksum(folder / cloud))
    changes = {"reference": reference, "regions": regions}
    write_knowledge(folder / "chair.yaml", bound.knowledge.model_copy(update=changes))
    return bound


def _compare(chair: str, result: TransferResult, truth: dict[str, np.ndarray]) -> list[Found]:
    rows = []
    for step in result.paths:
        match, metrics = result.regions[step.region].match, step.metrics
        true = truth.get(step.region)
        off = None if metrics is None or truth else metrics.true_distance_99_m
        rows.append(
            Found(
                chair=chair,
                region=step.region,
                process=step.process.kind,
                found=len(match.indices),
                true=None if true is None else int(true.sum()),
                iou=None if true is None else round(overlap(match.indices, true), 4),
                confidence=round(match.score, 4),
                coverage=None if metrics is None else round(metrics.coverage, 4),
                cycle_time_s=None if metrics is None else round(metrics.cycle_time_s, 1),
                true_distance_99_m=None if off is None else round(off, 6),
            )
        )
    return rows


def _note(found: list[Found], result: TransferResult) -> str:
    known = [row.iou for row in found if row.iou is not None]
    what = f"mean IoU {sum(known) / len(known):.2f}" if known else "a real chair, scanned"
    minutes = sum(row.cycle_time_s or 0.0 for row in found) / 60
    seconds = sum(result.seconds.values())
    return f"{what} · {minutes:.0f} min of tool paths in {seconds:.1f} s"


def _show(results: list[Found]) -> None:
    columns = ("chair", "region", "IoU", "confidence", "coverage", "time", "off mesh")
    shown = table("", *columns, texts=2)
    before = None
    for row in results:
        first = row.chair != before
        if first and before is not None:
            shown.add_section()
        before = row.chair
        shown.add_row(
            row.chair if first else "", f"{row.region}: {row.process}",
            _or_dash(row.iou, ".2f"), f"{row.confidence:.2f}",
            _or_dash(row.coverage, ".1%"), _or_dash(row.cycle_time_s, ".0f", " s"),
            _or_dash(row.true_distance_99_m and 1e3 * row.true_distance_99_m, ".1f", " mm"),
        )  # fmt: skip
    show(shown)


def _or_dash(value: float | None, form: str, unit: str = "") -> str:
    return "–" if value is None else f"{value:{form}}{unit}"
