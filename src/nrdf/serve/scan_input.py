"""A scan as the verbs and the line take it: read, cleaned, aligned, described."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nrdf.errors import CloudError

if TYPE_CHECKING:
    from nrdf.io.cloud import PointCloud
    from nrdf.regions.model import Model
    from nrdf.scans.aligned_scan import AlignedScan

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class ScanOptions:
    """What the verbs' options say about a scan; without `up` the target is no scan."""

    up: str | None
    sensor: tuple[float, ...] = ()
    unit: str | None = None
    skip: tuple[str, ...] = ()
    topic: str | None = None

    def refuse_without_up(self, *names: str) -> None:
        """Raise CloudError for one of these options where there is no scan to use it on."""
        if self.up is None and any(getattr(self, name) for name in names):
            *first, last = (f"--{name}" for name in names)
            raise CloudError(f"{', '.join(first)} and {last} are for scans: give --up")


def read_scan(
    model: Model, path: Path, options: ScanOptions, examples: Sequence[PointCloud] = ()
) -> AlignedScan:
    """Read, clean and align a scan.

    `examples` of the category stand in for members of its family where there are any. Raises
    CloudError for options without sense, an unreadable scan, or one without an object.
    """
    import numpy as np

    from nrdf.io.cloud import read_cloud
    from nrdf.scans.aligned_scan import align

    sensor = options.sensor
    if len(sensor) % 3:
        raise CloudError(
            f"--sensor has {len(sensor)} numbers; three are needed for each sensor: x y z"
        )
    positions = np.array(sensor, float).reshape(-1, 3) if sensor else None
    cloud = read_cloud(path, topic=options.topic)
    up = options.up or "auto"
    return align(model, cloud, up, positions, options.unit, options.skip, examples)


def alignment_examples(model: Model, reference: PointCloud) -> list[PointCloud]:
    """Examples to align by: none where the category has a family, else the reference."""
    from nrdf.shapes.families import FAMILY_NAMES

    return [] if model.category in FAMILY_NAMES else [reference]


def warn_of_scan(found: AlignedScan, path: Path) -> None:
    """Log a scan's warnings, and a guess of its unit."""
    if found.unit.origin == "guessed":
        log.info("%s: the unit is guessed to be %s", path, found.unit.name)
    warn_of(found.warnings, path)


def warn_of(warnings: Sequence[str], path: Path) -> None:
    """Log warnings about a file."""
    for warning in warnings:
        log.warning("%s: %s", path, warning)


def describe_alignment(found: AlignedScan) -> Mapping[str, Any]:
    """What a report says of a scan's cleaning and alignment."""
    import numpy as np

    from nrdf.scans.pose_scorer import USUAL_COST

    best, unit = found.alignment.best, found.unit
    sensors = found.scan.sensors
    return {
        "T_scan_canonical": best.pose.T_scan_canonical,
        "scale": best.pose.scale,
        "probability": round(best.probability, 4),
        "cost": round(best.cost, 4),
        "usual_cost": USUAL_COST,
        "kind": found.kind.describe(),
        "warnings": found.warnings,
        "unit": {"name": unit.name, "origin": unit.origin},
        "sensors": None if sensors is None else sensors,
        "candidates": [
            {
                "T_scan_canonical": c.pose.T_scan_canonical,
                "scale": c.pose.scale,
                "up": c.up,
                "yaw_degrees": round(float(np.degrees(c.yaw)), 2),
                "cost": round(c.cost, 4),
                "probability": round(c.probability, 4),
                "symmetry": round(c.symmetry, 3),
            }
            for c in found.alignment.candidates
        ],
        "cleaning": [vars(step) for step in found.cleaned.steps],
        "points": {"scan": len(found.scan), "object": len(found.cleaned.cloud)},
        "seconds_of_alignment": {k: round(v, 4) for k, v in found.alignment.seconds.items()},
    }
