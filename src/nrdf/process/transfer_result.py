"""What a transfer gives back: the regions found on a target, and a tool path for each process."""

from __future__ import annotations

from dataclasses import dataclass

from nrdf.geometry.similarity import Similarity
from nrdf.io.cloud import PointCloud
from nrdf.process.bound_knowledge import BoundKnowledge
from nrdf.process.process import Process, TransferMode
from nrdf.process_model.plan import PlannedResult
from nrdf.regions.match import Match
from nrdf.scans.kind_check import KindCheck
from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.target_mesh import TargetMesh
from nrdf.toolpath.metrics import ToolPathMetrics
from nrdf.toolpath.types import ToolPath

MIN_CONFIDENCE = 0.25
"""A region found with less mean confidence is skipped (docs/guides/scans.md)."""


@dataclass(frozen=True)
class FoundRegion:
    """A region on the target: its match; `missing` says why it is skipped, "" where it is not.

    mesh: the region's part of the target's mesh; None where it is skipped.
    """

    name: str
    match: Match
    missing: str = ""
    mesh: RegionMesh | None = None


@dataclass(frozen=True)
class PathResult:
    """One process on one region of the target.

    number: which of the region's processes, from 0. process: as it is on the target (its direction,
    or its warped waypoints, in the target's frame). transfer_mode: how it came there: "replan" or
    "warp". path, metrics: None where there is no path, for the `reason`. result: what the
    process will leave, where it has a target.
    """

    region: str
    number: int
    process: Process
    transfer_mode: TransferMode
    path: ToolPath | None = None
    metrics: ToolPathMetrics | None = None
    warnings: tuple[str, ...] = ()
    reason: str = ""
    result: PlannedResult | None = None


@dataclass(frozen=True)
class TransferResult:
    """Everything on one target, in metres in its own frame; paths in the order they are driven.

    Attributes:
        bound_knowledge: what was transferred.
        target: with normals, estimated where its file had none.
        regions: what was found of each region, by name.
        paths: one a process and region, with its tool path and metrics, or the reason for none.
        warnings: regions that are skipped or overlap.
        seconds: time by phase.
        pose: from canonical coordinates to the target's: how the object lies there.
        target_warnings: what is uncertain about the object's pose and unit.
        kind: what it looks like.
        surface: the target's mesh, which the paths are planned on; None where there is none.

    All warnings together: `nrdf.process.limits.strict_warnings`.
    """

    bound_knowledge: BoundKnowledge
    target: PointCloud
    regions: dict[str, FoundRegion]
    paths: tuple[PathResult, ...]
    warnings: tuple[str, ...]
    seconds: dict[str, float]
    pose: Similarity | None = None
    target_warnings: tuple[str, ...] = ()
    kind: KindCheck | None = None
    surface: TargetMesh | None = None


def reason_to_skip(match: Match, min_confidence: float) -> str:
    """Why a region is skipped; "" where it is not."""
    if match.presence.reason:
        return f"{match.presence.reason} (confidence {match.presence.confidence:.2f})"
    if not len(match.indices) and match.method == "marked":
        return "marked as not there"
    if not len(match.indices):
        return "found nowhere on the target"
    if match.score < min_confidence:
        return f"confidence {match.score:.2f}, below {min_confidence:g}"
    return ""
