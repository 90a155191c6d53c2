"""What the report of a simulation says: plain values, and how people read them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from nrdf.process.result_target import LEAST_WITHIN
from nrdf.reports.result_report import executed_content, executed_lines
from nrdf.robot.model.tool import PAD_GIVE_M
from nrdf.robot.planning.timing import STEP_S
from nrdf.robot.simulation.job import SimulationJob
from nrdf.robot.simulation.metrics import FORCE_BAND, VERDICTS
from nrdf.robot.simulation.simulate import SimulatedPath, SimulationResult
from nrdf.toolpath.cycle_time import estimate_cycle_time
from nrdf.viz.heat_map import HeatMap, heat_map

COLUMNS = (
    "reached", "region worked · planned", "left out · unreached", "force", "within ±20 %",
    "off plan, 99 %", "time",
)  # fmt: skip
_MOST_LISTED = 2000
_MOST_WARNED = 5

NOTES = (
    "The object stands on a turntable, which turns while the arm waits at home. What holds the "
    "object is not modelled, nor are the cables of the tool.",
    "The tool is a round, soft pad on a bent neck; its spin about its axis is free. The pad may "
    "touch whatever is beside the surface; everything behind it must touch nothing. Where the "
    "planned axis is blocked, the tool axis tilts, as far as the pad's give takes up.",
    f"Contact: the pad gives {1e3 * PAD_GIVE_M:.0f} mm at the commanded force, pushed along "
    "the tool's axis from where the scan's smooth surface is. The arm, its motors and its force "
    "sensor are MuJoCo's.",
    "Force is counted while the tool moves along its lines; before each line it waits until the "
    "force is there.",
    "Collisions are checked at every step of the simulation, between spheres that enclose every "
    "shape of the arm and the tool, the object's distance field, the floor and the arm itself. "
    "Path sections that collide are rejected, and the rest is planned and executed anew.",
)


def simulation_report(result: SimulationResult) -> dict[str, Any]:
    """Everything that report.json says of a simulation; SI."""
    job = result.simulation_job
    paths = [_path(path, _planned_seconds(path, job), job.upright) for path in result.paths]
    reached = sum(p["reached"] for p in paths)
    waypoints = sum(p["waypoints"] for p in paths)
    pressed = [p for p in paths if p["force"] is not None]
    contact = sum(p["force"]["seconds"] for p in pressed)
    within = sum(p["force"]["within"] * p["force"]["seconds"] for p in pressed)
    placement = result.placement
    assumed = [f"{job.origin}; --up says otherwise"] if job.assumed else []
    used = sorted({a.turntable_index for p in result.paths for a in p.program.actions})
    simulated_s = sum(p["time_s"] for p in paths)
    cpu = result.seconds.get("simulation", 0.0)
    kinematics = result.seconds.get("inverse kinematics", 0.0)
    return {
        "category": job.job.category,
        "unit": "m",
        "robot": {
            "name": result.arm.name,
            "tool_frame": result.arm.tool_frame,
            "joints": list(result.arm.joint_names),
            "checked": list(result.arm.checked),
        },
        "object": result.distance_field.origin,
        "placement": {
            "base_m": list(placement.base_m),
            "base_yaw_rad": placement.base_yaw_rad,
            "stand_m": placement.stand_m,
            "object_pose": job.origin,
            "up": job.upright[2].tolist(),
            "forward": job.upright[0].tolist(),
            "turntable_used_rad": [placement.turntable_rad[k] for k in used],
            "reachable_of_sample": round(result.reachable, 4),
        },
        "shift_m": result.shift_m.tolist(),
        "paths": paths,
        "total": {
            "waypoints": waypoints,
            "reached": reached,
            "reached_share": reached / waypoints,
            "tilted": sum(p["tilted"] for p in paths),
            "collisions": sum(len(p["collisions"]) for p in paths),
            "rejected": sum(len(p["rejected"]) for p in paths),
            "force_within": within / contact if contact else None,
            "time_s": simulated_s,
            "planned_time_s": sum(p["planned_time_s"] for p in paths),
        },
        "speed": {
            "ik_ms_per_waypoint": 1e3 * kinematics / waypoints,
            "times_real_time": simulated_s / cpu if cpu else None,
            "step_s": STEP_S,
        },
        "warnings": [*result.arm.warnings, *assumed, *_warnings(paths)],
        "notes": list(NOTES),
    }


def _planned_seconds(simulated: SimulatedPath, job: SimulationJob) -> float:
    """The cycle time that was expected before the arm was planned."""
    path, surface = simulated.path, job.surfaces.planned
    up = job.upright[2]
    return estimate_cycle_time(path.segments, surface, path.tool_radius_m, up).total_s


def executed_heat_maps(result: SimulationResult) -> list[HeatMap | None]:
    """A picture of what each path left, on the true mesh; None for those without a target."""
    job = result.simulation_job
    turn = canonical_axes(job.upright)
    drawn: list[HeatMap | None] = []
    for path in result.paths:
        left = path.result
        if left is None:
            drawn.append(None)
            continue
        values, target = left.cells.of_region(left.values_m), left.settings.target
        drawn.append(
            heat_map(
                job.surfaces.given,
                left.cells.fine,
                values,
                target.value_m,
                target.tolerance_m,
                turn,
            )
        )
    return drawn


def canonical_axes(upright: np.ndarray) -> np.ndarray:
    """From rows ahead, left, up (3, 3) to columns that are canonical: +X ahead, +Y up, +Z right."""
    return np.stack([upright[0], upright[2], -upright[1]], axis=1)


def _path(simulated: SimulatedPath, planned_s: float, upright: np.ndarray) -> dict[str, Any]:
    metrics, path = simulated.metrics, simulated.path
    force = None
    if metrics.force_commanded_n is not None and metrics.force_mean_n is not None:
        force = {
            "commanded_n": metrics.force_commanded_n,
            "mean_n": metrics.force_mean_n,
            "spread_n": metrics.force_spread_n,
            "within": metrics.force_within,
            "band": FORCE_BAND,
            "seconds": metrics.contact_s,
            "settling_s": metrics.settling_s,
        }
    missed = [
        {"line": group.process.line, "index": int(k), "verdict": str(verdict[k])}
        for group, verdict in zip(path.groups, metrics.verdicts, strict=True)
        for k in np.flatnonzero(verdict != "reached")
    ]
    left, result = simulated.result, None
    if left is not None:
        result = executed_content(
            left.settings, "film" if left.process.thickness_um else "depth", left.cells,
            left.values_m, left.metrics, left.planned, upright,
        )  # fmt: skip
    return {
        "region": path.region,
        "process": path.process,
        "tool": path.tool,
        "result": result,
        "lines": len(path.groups),
        "joint_paths": metrics.joint_paths,
        "waypoints": metrics.waypoints,
        "reached": metrics.reached,
        "verdicts": {name: metrics.count(name) for name in VERDICTS},
        "not_reached": missed[:_MOST_LISTED],
        "position_error_m": metrics.position_error_m,
        "axis_error_rad": metrics.axis_error_rad,
        "tilted": metrics.tilted,
        "max_tilt_rad": metrics.max_tilt_rad,
        "coverage": {
            "planned": metrics.planned.worked,
            "executed": metrics.executed.worked,
            "achieved": metrics.achieved.worked,
            "left_out": metrics.achieved.left_out,
            "unreached": metrics.achieved.unreached,
        },
        "force": force,
        "off_plan_99_m": metrics.off_plan_99_m,
        "slower_than_feed_share": metrics.slow_share,
        "time_s": metrics.cycle_time_s,
        "planned_time_s": planned_s,
        "seconds": metrics.seconds,
        "collisions": [vars(collision) for collision in simulated.collisions],
        "rejected": [vars(collision) for collision in simulated.rejected],
    }


def _warnings(paths: list[dict[str, Any]]) -> list[str]:
    lines = []
    for path in paths:
        name = f"{path['region']}, {path['process']}"
        missed = path["waypoints"] - path["reached"]
        if missed:
            kinds = ", ".join(
                f"{count} {kind}"
                for kind, count in path["verdicts"].items()
                if count and kind != "reached"
            )
            where = "; ".join(
                f"line {m['line']} index {m['index']}: {m['verdict']}"
                for m in path["not_reached"][:_MOST_WARNED]
            )
            more = ", ..." if missed > _MOST_WARNED else ""
            lines.append(
                f"{name}: {missed} of {path['waypoints']} waypoints not reached ({kinds}): "
                f"{where}{more}"
            )
        if path["collisions"]:
            worst = max(path["collisions"], key=lambda c: c["depth_m"])
            lines.append(
                f"{name}: {len(path['collisions'])} moves collide; the worst, "
                f"{worst['kind']} of line {worst['line']}, the {worst['what']} by "
                f"{1e3 * worst['depth_m']:.1f} mm: do not run them"
            )
        if path["rejected"]:
            kinds = ", ".join(sorted({c["kind"] for c in path["rejected"]}))
            lines.append(
                f"{name}: {len(path['rejected'])} moves ({kinds}) collided when they were tried, "
                "and are left out"
            )
        if path["tilted"]:
            lines.append(
                f"{name}: at {path['tilted']} waypoints the tool axis is tilted from the "
                f"planned one, by {np.degrees(path['max_tilt_rad']):.0f}° at most, as something "
                "is in its way"
            )
        lines += [f"{name}: {line}" for line in _result_warnings(path)]
        if path["slower_than_feed_share"] > 0.1:
            lines.append(
                f"{name}: at {path['slower_than_feed_share']:.0%} of the waypoints the joints "
                "are too slow for the whole feed"
            )
    return lines


def _result_warnings(path: Mapping[str, Any]) -> list[str]:
    """What a person should look at of the film or depth that the arm left."""
    content = path["result"]
    if content is None or content["executed"]["within"] >= LEAST_WITHIN:
        return []
    done, planned = content["executed"], content["planned"]
    wanted = dict(executed_lines(content))[f"{content['what']} wanted"]
    return [
        f"{done['within']:.1%} of the region has {wanted} (planned: {planned['within']:.1%}); "
        f"{done['below']:.1%} less, {done['above']:.1%} more"
    ]


def metrics_row(path: Mapping[str, Any]) -> list[str]:
    """A path's metrics as people read them, one for each of `COLUMNS`."""
    force, coverage = path["force"], path["coverage"]
    return [
        f"{path['reached'] / path['waypoints']:.1%}",
        f"{coverage['achieved']:.1%} · {coverage['planned']:.1%}",
        f"{sum(coverage['left_out'].values()):.1%} · {coverage['unreached']:.1%}",
        "–" if force is None else f"{force['mean_n']:.1f} ± {force['spread_n']:.1f} N",
        "–" if force is None else f"{force['within']:.1%}",
        f"{1e3 * path['off_plan_99_m']:.1f} mm",
        f"{path['time_s']:.0f} s",
    ]
