"""The report of a transfer as plain values: regions, tool paths, metrics, warnings, limits."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from nrdf.process.limits import Limits, strict_warnings
from nrdf.process.path_warnings import path_warnings
from nrdf.process.process import Process
from nrdf.process.transfer_result import PathResult, TransferResult
from nrdf.reports.result_report import result_content
from nrdf.surface.target_mesh import TargetMesh
from nrdf.toolpath.file import pose_to_dict
from nrdf.toolpath.region_samples import REASONS

METRIC_COLUMNS = (
    "worked · left out · unreached", "overlap", "line spacing, mean · worst",
    "largest step · turn · turn by mm", "off the object, 95 % · worst",
    "off the mesh planned on, 99 % · worst", "axis off, 99 %", "length", "time",
)  # fmt: skip
SHORT_METRIC_COLUMNS = (
    "worked, %", "left out, %", "missed, %", "lines, mm", "step, mm", "turn, °", "off, mm",
    "time, s",
)  # fmt: skip
"""For a terminal: shares of the whole region; worst line spacing; largest step and turn between
waypoints; distance from the object as given, 95th percentile; cycle time."""


def transfer_report(result: TransferResult, limits: Limits) -> dict[str, Any]:
    """Everything of a transfer that a report says, as plain values; lengths in metres."""
    regions = result.regions
    turn = np.eye(3) if result.pose is None else result.pose.rotation
    paths = [_path(step, bool(regions[step.region].missing), turn) for step in result.paths]
    metrics = [step.metrics for step in result.paths if step.metrics is not None]
    strict = strict_warnings(result)
    # A skipped region is warned about as such.
    skipped = tuple(f"region '{name}':" for name, r in regions.items() if r.missing)
    warnings = [line for line in strict if not line.startswith(skipped)]
    warnings += result.warnings
    for step in paths:
        if step["warnings"]:
            joined = "; ".join(step["warnings"])
            warnings.append(f"region '{step['region']}', {step['process']}: {joined}")
    return {
        "category": result.bound_knowledge.knowledge.category,
        "unit": "m",
        "frame": result.target.frame,
        "pose": pose_to_dict(result.pose),
        "surface": _surface(result.surface),
        "regions": _regions(result),
        "paths": paths,
        "total": {
            "paths": len(metrics),
            "skipped": len(result.paths) - len(metrics),
            "path_length_m": sum(m.path_length_m for m in metrics),
            "process_length_m": sum(m.process_length_m for m in metrics),
            "cycle_time_s": sum(m.cycle_time_s for m in metrics),
        },
        "warnings": warnings,
        "strict_warnings": strict,
        "kind": None if result.kind is None else result.kind.describe(),
        "limits": {
            "set": {k: v for k, v in vars(limits).items() if v not in (None, False)},
            "not_met": limits.broken(result),
        },
    }


def _surface(mesh: TargetMesh | None) -> dict[str, Any] | None:
    """The mesh that paths are planned on."""
    if mesh is None:
        return None
    return {
        "faces": len(mesh.faces),
        "edge_length_m": round(mesh.edge_length, 6),
        "repairs": list(mesh.repairs),
    }


def _regions(result: TransferResult) -> dict[str, Any]:
    reference, target = result.bound_knowledge, result.target
    regions = {}
    for name, region in result.regions.items():
        match = region.match
        regions[name] = {
            "found": not region.missing,
            "reason": region.missing or None,
            "confidence": round(match.score, 4),
            "points": len(match.indices),
            "share_of_target": round(len(match.indices) / len(target), 5),
            "share_of_reference": round(
                len(reference.regions[name]) / len(reference.cloud), 5
            ),
            "area_m2": None if region.mesh is None else round(region.mesh.area_m2, 6),
            "changes": [] if region.mesh is None else list(region.mesh.changes),
        }  # fmt: skip
    return regions


def _path(step: PathResult, skipped: bool, turn: np.ndarray) -> dict[str, Any]:
    process = step.process
    content: dict[str, Any] = {
        "region": step.region,
        "number": step.number,
        "process": process.label,
        "kind": process.kind,
        "transfer": step.transfer_mode,
        "planned": step.path is not None,
        "reason": step.reason or None,
        "requested": _requested(process),
        "warnings": [*step.warnings],
    }
    if step.path is not None and step.metrics is not None:
        process_segments = [s for s in step.path.segments if s.kind == "process"]
        content["lines"] = len({segment.line for segment in process_segments})
        content["waypoints"] = sum(len(segment.positions) for segment in step.path.segments)
        content["metrics"] = vars(step.metrics)
        content["result"] = result_content(step, turn[:, 1], turn[:, 0])
        content["warnings"] += path_warnings(process, step.metrics)
    elif not skipped:
        content["warnings"].append(f"no tool path: {step.reason}")
    return content


def _requested(process: Process) -> dict[str, Any]:
    """What the process asks for, apart from waypoints."""
    content = process.model_dump(mode="json", exclude_none=True, exclude={"waypoints", "name"})
    content["stepover_m"] = process.distance_between_lines_m
    return content


def left_out_in_words(left_out: Mapping[str, float]) -> str:
    """What is left out of a region, share by share, or a dash."""
    shares = [f"{REASONS.get(why, why)} {share:.1%}" for why, share in left_out.items() if share]
    return ", ".join(shares) or "–"


def shares_in_words(metrics: Mapping[str, Any]) -> str:
    """What is worked, left out and not reached of a whole region, in per cent."""
    left_out = sum(metrics["left_out"].values())
    shares = (metrics["coverage"], left_out, metrics["unreached"])
    return " · ".join(f"{100.0 * share:.1f}" for share in shares) + " %"


def jump_in_words(metrics: Mapping[str, Any]) -> str:
    """The largest step between neighbouring waypoints, and the largest turn."""
    turn = f"{np.degrees(metrics['turn_worst_rad']):.0f}°"
    return f"{_millimetres(metrics['step_worst_m'])} · {turn}"


def metric_cells(metrics: Mapping[str, Any]) -> list[str]:
    """A tool path's metrics as people read them, one for each of `METRIC_COLUMNS`."""
    length, time = f"{metrics['process_length_m']:.2f} m", f"{metrics['cycle_time_s']:.0f} s"
    spacing = _millimetres(metrics["line_spacing_mean_m"], metrics["line_spacing_worst_m"])
    true = _millimetres(metrics["true_distance_95_m"], metrics["true_distance_worst_m"])
    away = _millimetres(metrics["surface_distance_99_m"], metrics["surface_distance_worst_m"])
    shares, overlap = shares_in_words(metrics), f"{metrics['overlap']:.0%}"
    axis = f"{np.degrees(metrics['axis_error_99_rad']):.1f}°"
    jump = jump_in_words(metrics)
    jump += f" · {np.degrees(metrics['bend_worst_rad_m']) / 1e3:.1f}°/mm"
    return [shares, overlap, spacing, jump, true, away, axis, length, time]


def short_metric_cells(metrics: Mapping[str, Any]) -> list[str]:
    """The metrics shown in a terminal, one for each of `SHORT_METRIC_COLUMNS`."""
    shares = shares_in_words(metrics).removesuffix(" %").split(" · ")
    lengths = ("line_spacing_worst_m", "step_worst_m", "true_distance_95_m")
    spacing, step, off = (_millimetres(metrics[name]).removesuffix(" mm") for name in lengths)
    turn, time = np.degrees(metrics["turn_worst_rad"]), metrics["cycle_time_s"]
    return [*shares, spacing, step, f"{turn:.0f}", off, f"{time:.0f}"]


def _millimetres(*lengths: float | None) -> str:
    """Lengths in metres side by side in millimetres; a dash where one is missing."""
    known = [length for length in lengths if length is not None]
    if len(known) < len(lengths):
        return "–"
    return " · ".join(f"{1e3 * length:.1f}" for length in known) + " mm"
