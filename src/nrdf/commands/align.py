"""`nrdf align`: where a scan's object stands, how it is turned, and how large it is."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

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

if TYPE_CHECKING:
    from nrdf.io.cloud import PointCloud
    from nrdf.regions.model import Model
    from nrdf.scans.aligned_scan import AlignedScan
    from nrdf.viz.picture import Panel

log = logging.getLogger(__name__)

Unit = Literal["m", "cm", "mm", "in"]
Skip = Literal["thin", "duplicates", "floor", "outliers", "objects"]
MOST_POSES = 3  # that a picture shows


def align(
    scan: Positional[Path],
    model: str,
    out: Path,
    up: str = "auto",
    sensor: tuple[float, ...] = (),
    unit: Unit | None = None,
    skip: tuple[Skip, ...] = (),
    topic: str | None = None,
    reference: tuple[Path, ...] = (),
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

    Example: nrdf align scan.ply --model chair --up z --out aligned/

    Args:
        scan: Point cloud or mesh, or a ROS 2 bag, of one object, in any pose and unit.
        model: Name in the zoo (see `nrdf info`), weight file, or training run's folder.
        out: Folder to write; made if missing.
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
        strict: End with 3 where there is any doubt: an ambiguous pose, a poor fit, several objects,
            an unlikely unit.
        overwrite: Replace an earlier result in the output folder.
    """
    from nrdf.io.output import output_folder

    with output_folder(out, overwrite, [scan, *reference, model]) as folder:
        import nrdf
        from nrdf.io.cloud import PointCloud
        from nrdf.viz.picture import draw_regions

        loaded = nrdf.load_model(model, device)
        examples = [nrdf.read_cloud(path) for path in reference]
        found = read_scan(loaded, scan, up, sensor, unit, skip, topic, examples)
        warn_of_doubts(found, scan)
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


def read_scan(
    model: Model,
    path: Path,
    up: str,
    sensor: tuple[float, ...] = (),
    unit: str | None = None,
    skip: tuple[str, ...] = (),
    topic: str | None = None,
    examples: Sequence[PointCloud] = (),
) -> AlignedScan:
    """Read, clean and align a scan by a command's options.

    `examples` of the category stand in for members of its family where there are any. Raises
    CloudError for options without sense, an unreadable scan, or one without an object.
    """
    import numpy as np

    import nrdf
    from nrdf.errors import CloudError

    if len(sensor) % 3:
        raise CloudError(
            f"--sensor has {len(sensor)} numbers; three are needed for each sensor: x y z"
        )
    places = np.array(sensor, float).reshape(-1, 3) if sensor else None
    cloud = nrdf.read_cloud(path, topic=topic)
    return nrdf.align(model, cloud, up, places, unit, skip, examples)


def stand_ins(model: Model, reference: PointCloud) -> list[PointCloud]:
    """Examples to align by: none where the category has a family, else the reference."""
    from nrdf.shapes.families import FAMILY_NAMES

    return [] if model.category in FAMILY_NAMES else [reference]


def warn_of_doubts(found: AlignedScan, path: Path) -> None:
    """Log every doubt about a scan as a warning, and a guess of its unit."""
    if found.unit.origin == "guessed":
        log.info("%s: the unit is guessed to be %s", path, found.unit.name)
    warn_of(found.warnings, path)


def warn_of(doubts: Sequence[str], path: Path) -> None:
    """Log doubts about a file as warnings."""
    for doubt in doubts:
        log.warning("%s: %s", path, doubt)


def describe_alignment(found: AlignedScan) -> Mapping[str, Any]:
    """What a report says of a scan's cleaning and alignment."""
    import numpy as np

    best, unit = found.alignment.best, found.unit
    sensors = found.scan.sensors
    return {
        "T_scan_canonical": best.pose.T_scan_canonical,
        "scale": best.pose.scale,
        "probability": round(best.probability, 4),
        "cost": round(best.cost, 4),
        "field_cost": round(best.field_cost, 4),
        "usual_cost": round(found.scorer.usual_cost, 4),
        "kind": found.kind.describe(),
        "doubts": found.warnings,
        "unit": {"name": unit.name, "origin": unit.origin},
        "sensors": None if sensors is None else sensors,
        "candidates": [
            {
                "T_scan_canonical": c.pose.T_scan_canonical,
                "scale": c.pose.scale,
                "up": c.up,
                "yaw_degrees": round(float(np.degrees(c.yaw)), 2),
                "cost": round(c.cost, 4),
                "field_cost": round(c.field_cost, 4),
                "probability": round(c.probability, 4),
                "symmetry": round(c.symmetry, 3),
            }
            for c in found.alignment.candidates
        ],
        "cleaning": [vars(step) for step in found.cleaned.steps],
        "points": {"scan": len(found.scan), "object": len(found.cleaned.cloud)},
        "seconds_of_alignment": {k: round(v, 4) for k, v in found.alignment.seconds.items()},
    }


def pose_panels(found: AlignedScan) -> list[Panel]:
    """The object in each likely pose, as the category's frame has it."""
    from nrdf.viz.picture import Panel

    seen, panels = found.encode(), []
    for candidate in found.alignment.likely[:MOST_POSES]:
        turn = found.alignment.best.pose.rotation.T @ candidate.pose.rotation
        points = candidate.pose.to_canonical(seen.original(seen.points))
        title = f"probability {candidate.probability:.2f}"
        panels.append(Panel(title, points, seen.normals @ turn, note="+X forward, +Y up"))
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
