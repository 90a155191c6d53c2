"""`nrdf align`: where a scan's object stands, how it is turned, and how large it is."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tyro.conf import Positional

from nrdf.commands.console import (
    command_line,
    console,
    provenance,
    show,
    table,
    versions,
    write_report,
)
from nrdf.commands.options import File, Folder, Sensors, Skip, Unit, Up
from nrdf.serve.scan_input import ScanOptions, describe_alignment, read_scan, warn_of_scan

if TYPE_CHECKING:
    from nrdf.scans.aligned_scan import AlignedScan
    from nrdf.viz.picture import Panel

MOST_POSES = 3  # that a picture shows


def align(
    scan: Positional[File],
    model: str,
    out: Folder | None = None,
    up: Up = "auto",
    sensor: Sensors = (),
    unit: Unit | None = None,
    skip: tuple[Skip, ...] = (),
    topic: str | None = None,
    reference: tuple[File, ...] = (),
    device: str = "cpu",
    strict: bool = False,
    overwrite: bool = False,
) -> int:
    """Find pose and scale of the object in a scan.

    The floor, outliers and all objects but the largest are removed first. Writes into the output
    folder: report.json with T_scan_canonical and scale (p_scan = T_scan_canonical (scale
    p_canonical)), other likely poses and their probabilities, what cleaning removed; object.ply,
    what was kept, in the scan's frame; aligned.ply, the same with +X forward and +Y up, its longest
    side 1; picture.png.

    Example: nrdf align scan.ply --model chair --up z

    Args:
        scan: Point cloud or mesh, or a ROS 2 bag, of one object, in any pose and unit.
        model: Name in the zoo (see `nrdf info`), weight file, or training run's folder;
            general or registration, which serve any category, and align by a --reference.
        out: Folder to write; aligned-NAME unless given.
        up: Direction in the scan that points up: x, y, z, -x, -y, -z, or 'x y z'; auto takes the
            floor's, or tries the axes, which takes longer.
        sensor: Where the sensors stood: x y z of each, in the scan's frame and unit. The file may
            say so as well.
        unit: Unit of the scan; what its file says, or what is usual for the category, unless given.
        skip: Steps of cleaning to leave out.
        topic: What to read of a ROS 2 bag that has clouds under several topics.
        reference: Examples of the category, +X forward and +Y up, to align by instead of members of
            its parametric family; needed for a category that has none.
        device: cpu, cuda, cuda:N or auto.
        strict: End with 3 where there is any warning: an ambiguous pose, a poor fit, several
            objects, an unlikely unit.
        overwrite: Replace an earlier result in the output folder.
    """
    from nrdf.io.output import output_folder

    out = out or Path(f"aligned-{scan.stem}")
    with output_folder(out, overwrite, [scan, *reference, model]) as folder:
        import nrdf
        from nrdf.io.cloud import PointCloud
        from nrdf.viz.picture import draw_regions

        loaded = nrdf.load_model(model, device)
        examples = [nrdf.read_cloud(path) for path in reference]
        found = read_scan(loaded, scan, ScanOptions(up, sensor, unit, skip, topic), examples)
        warn_of_scan(found, scan)
        best, cleaned = found.alignment.best, found.cleaned
        points = best.pose.to_canonical(cleaned.cloud.points)
        nrdf.write_cloud(folder / "aligned.ply", PointCloud(points, frame=loaded.category))
        nrdf.write_cloud(folder / "object.ply", cleaned.cloud, scalars={"index": cleaned.kept})
        draw_regions(pose_panels(found), folder / "picture.png")
        report = {
            "command": command_line(),
            "model": provenance(loaded.metadata),
            "scan": str(scan),
            **describe_alignment(found),
            "versions": versions(),
        }
        write_report(folder, report)
    show_alignment(found)
    console.print(f"results, report and picture in {out}")
    return 3 if strict and found.warnings else 0


def pose_panels(found: AlignedScan) -> list[Panel]:
    """The object in each likely pose, as the category's frame has it."""
    from nrdf.viz.picture import Panel

    encoded, panels = found.encode(), []
    for candidate in found.alignment.likely[:MOST_POSES]:
        turn = found.alignment.best.pose.rotation.T @ candidate.pose.rotation
        points = candidate.pose.to_canonical(encoded.original(encoded.points))
        title = f"probability {candidate.probability:.2f}"
        panels.append(Panel(title, points, encoded.normals @ turn, note="+X forward, +Y up"))
    return panels


def show_alignment(found: AlignedScan) -> None:
    """What cleaning and alignment did, for a person."""
    import numpy as np

    shown = table("", "cleaning", "points removed", "")
    for step in found.cleaned.steps:
        shown.add_row(step.name, str(step.removed), step.note)
    show(shown)
    unit = found.unit.name or ""
    origin = " (guessed)" if found.unit.origin == "guessed" else ""
    shown = table("", "pose", "probability", "cost", "yaw", "longest side", "mirror")
    for number, c in enumerate(found.alignment.candidates, 1):
        shown.add_row(
            str(number), f"{c.probability:.2f}", f"{c.cost:.3f}", f"{np.degrees(c.yaw):.1f}°",
            f"{c.pose.scale:.4g} {unit}{origin}", f"{c.symmetry:.2f}",
        )  # fmt: skip
    show(shown)
