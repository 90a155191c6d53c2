"""`nrdf retrieve`: the regions of a reference, found on a target."""

from __future__ import annotations

import logging
import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

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
from nrdf.errors import NothingFoundError
from nrdf.serve.scan_input import (
    ScanOptions,
    alignment_examples,
    describe_alignment,
    read_scan,
    warn_of,
    warn_of_scan,
)

if TYPE_CHECKING:
    import numpy as np

    from nrdf.field.encoded_cloud import EncodedCloud
    from nrdf.io.cloud import PointCloud
    from nrdf.regions.match import Match
    from nrdf.viz.picture import Panel

log = logging.getLogger(__name__)


def retrieve(
    model: str,
    reference: File,
    region: tuple[File, ...],
    target: File,
    out: Folder | None = None,
    method: Literal["mask", "points"] = "mask",
    refine: bool = False,
    up: Up | None = None,
    sensor: Sensors = (),
    unit: Unit | None = None,
    skip: tuple[Skip, ...] = (),
    topic: str | None = None,
    device: str = "cpu",
    strict: bool = False,
    overwrite: bool = False,
) -> int:
    """Find the regions of a reference object on a target object.

    Both are of the category that the model is for, or, with --model general, of any one. With
    --up the target is a scan in any pose: it is cleaned and aligned first, as by `nrdf align`.

    Writes into the output folder: for each region a PLY of the target's own points in it, with
    confidence (0 to 1) and index (into the target) as properties; report.json; picture.png. All
    in the target file's own coordinates and unit. A region that the target does not have, or that
    the scan did not see, is empty, and the report says which. Where none of them is found it ends
    with 4, after writing.

    Example: nrdf retrieve --model chair --reference ref.ply --region seat.ply back.ply --target
    new.ply

    Args:
        model: Name in the zoo (see `nrdf info`), weight file, or training run's folder;
            general or registration, which serve any category.
        reference: Cloud or mesh of the object on which the regions are known: +X forward, +Y up;
            any unit, scale and place.
        region: One file a region, named by it: a cloud whose points lie on the reference, a .npy of
            points (m, 3), of a mask (n,) or of indices (m,) of the reference's points; or a .npz
            of such arrays, one a region.
        target: Cloud or mesh of the object to find them on, in the same frame, or in any with --up;
            any unit.
        out: Folder to write; regions-NAME, by the target's name, unless given.
        method: mask: k-nearest voting: the mapped reference points nearest to each target point,
            and alike in how the surface lies;
            points: each region point's prediction is snapped to the target (the paper's).
        refine: Move the mapped reference onto the target in a few steps first, about half a second
            more.
        up: The target is a scan; direction in it that points up: x, y, z, -x, -y, -z, or 'x y z',
            or auto.
        sensor: Where the scan's sensors stood: x y z of each. The file may say so as well.
        unit: Unit of the scan, instead of what its file says.
        skip: Steps of cleaning the scan to leave out.
        topic: What to read of a ROS 2 bag that has clouds under several topics.
        device: cpu, cuda, cuda:N or auto.
        strict: End with 3 where there is any warning about the target: its kind, how it stands,
            a scan's pose.
        overwrite: Replace an earlier result in the output folder.
    """
    from nrdf.io.output import output_folder

    out = out or Path(f"regions-{target.stem}")
    options = ScanOptions(up, sensor, unit, skip, topic)
    warnings: list[str] = []
    with output_folder(out, overwrite, [reference, *region, target, model]) as folder:
        clock = Clock()
        import nrdf
        from nrdf.regions.files import read_regions, write_matches
        from nrdf.viz.picture import draw_regions

        loaded = nrdf.load_model(model, device)
        clock.lap("load model")
        reference_cloud = nrdf.read_cloud(reference)
        scan = None
        if up is None:
            options.refuse_without_up("sensor", "unit", "skip")
            target_cloud = nrdf.read_cloud(target, topic=topic)
        else:
            examples = alignment_examples(loaded, reference_cloud)
            scan = read_scan(loaded, target, options, examples)
            warn_of_scan(scan, target)
            target_cloud, warnings = scan.scan, scan.warnings
        regions = read_regions(region, reference_cloud.unit)
        clock.lap("read files")
        encoded = loaded.set_reference(reference_cloud)
        clock.lap("reference")
        encoded_target = loaded.encode(target_cloud) if scan is None else scan.encode()
        kind = encoded.check_kind(encoded_target) if scan is None else scan.kind
        if scan is None:
            warnings = list(kind.warnings)
            warn_of(warnings, target)
        matches = encoded.retrieve_all(regions, encoded_target, method, refine, check=False)
        clock.lap("target and regions")
        taught = {
            name: encoded.encoded_cloud.to_working(indices)
            for name, indices in reference_indices(regions, reference_cloud).items()
        }
        found = {name: match.working for name, match in matches.items()}
        panels = [
            encoded_panel(f"{reference.name} (reference)", encoded.encoded_cloud, taught),
            encoded_panel(target.name, encoded_target, found),
        ]
        if scan is not None:
            matches = {name: match.in_scan(scan) for name, match in matches.items()}
        write_matches(folder, target_cloud, matches)
        draw_regions(panels, folder / "picture.png")
        clock.lap("write")
        report = {
            "command": command_line(),
            "model": provenance(loaded.metadata),
            "method": method,
            "refine": refine,
            "reference": describe_cloud(reference, reference_cloud),
            "target": describe_cloud(target, target_cloud),
            "coordinates": "the target file's own frame and unit",
            "kind": kind.describe(),
            **({} if scan is None else {"alignment": describe_alignment(scan)}),
            "regions": describe_matches(matches, target_cloud),
            "seconds": {**clock.seconds, "of the target": encoded_target.seconds},
            "versions": versions(),
        }
        write_report(folder, report)
    show_matches(matches, target_cloud)
    console.print(f"{clock.total:.1f} s; results, report and picture in {out}")
    if not any(len(match.indices) for match in matches.values()):
        raise NothingFoundError(_nothing_found(target, up))
    return 3 if strict and warnings else 0


class Clock:
    """Seconds between laps by name."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, name: str) -> None:
        now = time.perf_counter()
        self.seconds[name] = round(now - self._last, 4)
        self._last = now

    @property
    def total(self) -> float:
        return sum(self.seconds.values())


def reference_indices(
    regions: Mapping[str, np.ndarray], reference: PointCloud
) -> dict[str, np.ndarray]:
    """Each region as indices of the reference's points."""
    from nrdf.regions.region import whole_region

    return {name: whole_region(values, reference) for name, values in regions.items()}


def encoded_panel(title: str, encoded: EncodedCloud, regions: Mapping[str, np.ndarray]) -> Panel:
    """An encoded cloud in the category's frame, with regions as indices of its working points."""
    from nrdf.viz.picture import Panel

    return Panel(title, encoded.points, encoded.normals, dict(regions))


def describe_cloud(path: Path, cloud: PointCloud) -> dict[str, Any]:
    return {
        "file": str(path),
        "points": len(cloud),
        "normals": "given" if cloud.normals is not None else "estimated",
        "unit": cloud.unit,
        "frame": cloud.frame,
        "bounding_box": [cloud.points.min(axis=0).tolist(), cloud.points.max(axis=0).tolist()],
    }


def describe_matches(matches: Mapping[str, Match], target: PointCloud) -> dict[str, Any]:
    return {
        name: {
            "file": f"{name}.ply",
            "points": len(match.indices),
            "share_of_target": round(len(match.indices) / len(target), 5),
            "mean_confidence": round(match.score, 4),
            "reason": match.presence.reason or None,
            "confidence_of_presence": round(match.presence.confidence, 4),
            "share_observed": round(match.presence.observed, 4),
            "centre": target.points[match.indices].mean(axis=0).tolist()
            if len(match.indices)
            else None,
        }
        for name, match in matches.items()
    }


def _nothing_found(target: Path, up: str | None) -> str:
    return f"none of the regions was found on {target}: " + (
        "is it of the model's category, upright (+Y up) and facing +X? For a scan in another pose "
        "try --up z (or x, y, -z, auto)"
        if up is None
        else f"is it of the model's category, and is {up} the direction that points up?"
    )


def show_matches(matches: Mapping[str, Match], target: PointCloud) -> None:
    shown = table("", "region", "points", "of the target", "mean confidence")
    for name, match in matches.items():
        share = len(match.indices) / len(target)
        shown.add_row(name, f"{len(match.indices)}", f"{share:.1%}", f"{match.score:.2f}")
        if match.presence.reason:
            sure = match.presence.confidence
            log.warning("region '%s': %s (confidence %.2f)", name, match.presence.reason, sure)
        elif not len(match.indices):
            log.warning("region '%s' was found nowhere on the target", name)
    show(shown)
