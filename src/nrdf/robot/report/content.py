"""The report of a simulation as plain values, and as people read them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from nrdf.robot.model.tool import PAD_GIVES_M
from nrdf.robot.planning.timing import STEP_S
from nrdf.robot.simulation.metrics import FORCE_BAND, VERDICTS
from nrdf.robot.simulation.simulate import SimulatedPath, SimulationResult

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
    "planned axis is blocked, the tool leans, as far as the pad's give takes up.",
    f"Contact: the pad gives {1e3 * PAD_GIVES_M:.0f} mm at the commanded force, pushed along "
    "the tool's axis from where the scan's smooth surface is. The arm, its motors and its force "
    "sensor are MuJoCo's.",
    "Force is counted while the tool moves along its lines; before each line it waits until the "
    "force is there.",
    "Collisions are looked for at every step of the simulation, between spheres that enclose every "
    "shape of the arm and the tool, the object's distance field, the floor and the arm itself. "
    "Moves that touched something are left out, and the rest is planned and driven anew.",
)


def simulation_report(simulated: SimulationResult) -> dict[str, Any]:
    """Everything that a simulation's report says; SI."""
    paths = [_path(driven) for driven in simulated.paths]
    reached = sum(p["reached"] for p in paths)
    waypoints = sum(p["waypoints"] for p in paths)
    pressed = [p for p in paths if p["force"] is not None]
    contact = sum(p["force"]["seconds"] for p in pressed)
    within = sum(p["force"]["within"] * p["force"]["seconds"] for p in pressed)
    place, work = simulated.placement, simulated.simulation_job
    assumed = [f"{work.origin}; --up says otherwise"] if work.assumed else []
    used = sorted({a.turn for d in simulated.paths for a in d.program.actions})
    simulated_s = sum(p["time_s"] for p in paths)
    cpu = simulated.seconds.get("simulation", 0.0)
    kinematics = simulated.seconds.get("inverse kinematics", 0.0)
    return {
        "category": work.job.category,
        "unit": "m",
        "robot": {
            "name": simulated.arm.name,
            "tool_frame": simulated.arm.tool_frame,
            "joints": list(simulated.arm.joint_names),
            "checked": list(simulated.arm.checked),
        },
        "object": simulated.distance_field.origin,
        "placement": {
            "base_m": list(place.base_m),
            "base_yaw_rad": place.base_yaw_rad,
            "stand_m": place.stand_m,
            "object_lies": work.origin,
            "up": work.upright[2].tolist(),
            "forward": work.upright[0].tolist(),
            "turns_used_rad": [place.turns_rad[k] for k in used],
            "reachable_of_sample": round(simulated.reachable, 4),
        },
        "shift_m": simulated.shift_m.tolist(),
        "paths": paths,
        "total": {
            "waypoints": waypoints,
            "reached": reached,
            "reached_share": reached / waypoints,
            "leaning": sum(p["leaning"] for p in paths),
            "collisions": sum(len(p["collisions"]) for p in paths),
            "avoided": sum(len(p["avoided"]) for p in paths),
            "force_within": within / contact if contact else None,
            "time_s": simulated_s,
        },
        "speed": {
            "ik_ms_per_waypoint": 1e3 * kinematics / waypoints,
            "times_real_time": simulated_s / cpu if cpu else None,
            "step_s": STEP_S,
        },
        "warnings": [*simulated.arm.warnings, *assumed, *_warnings(paths)],
        "notes": list(NOTES),
    }


def _path(driven: SimulatedPath) -> dict[str, Any]:
    out, path = driven.metrics, driven.path
    force = None
    if out.force_asked_n is not None and out.force_mean_n is not None:
        force = {
            "asked_n": out.force_asked_n,
            "mean_n": out.force_mean_n,
            "spread_n": out.force_spread_n,
            "within": out.force_within,
            "band": FORCE_BAND,
            "seconds": out.contact_s,
            "settling_s": out.settling_s,
        }
    missed = [
        {"line": line.number, "index": int(k), "verdict": str(verdict[k])}
        for line, verdict in zip(driven.lines, out.verdicts, strict=True)
        for k in np.flatnonzero(verdict != "reached")
    ]
    return {
        "region": path.region,
        "process": path.process,
        "tool": path.tool,
        "lines": len(driven.lines),
        "pieces": out.pieces,
        "waypoints": out.waypoints,
        "reached": out.reached,
        "verdicts": {name: out.count(name) for name in VERDICTS},
        "not_reached": missed[:_MOST_LISTED],
        "position_error_m": out.position_error_m,
        "axis_error_rad": out.axis_error_rad,
        "leaning": out.leaning,
        "most_lean_rad": out.most_lean_rad,
        "coverage": {
            "planned": out.planned.worked,
            "driven": out.driven.worked,
            "achieved": out.achieved.worked,
            "left_out": out.achieved.left_out,
            "unreached": out.achieved.unreached,
        },
        "force": force,
        "off_plan_99_m": out.off_plan_99_m,
        "slower_than_feed_share": out.slow_share,
        "time_s": out.cycle_time_s,
        "seconds": out.seconds,
        "collisions": [vars(collision) for collision in driven.collisions],
        "avoided": [vars(collision) for collision in driven.avoided],
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
                f"{name}: {len(path['collisions'])} moves touch what they should not; the worst, "
                f"{worst['kind']} of line {worst['line']}, the {worst['what']} by "
                f"{1e3 * worst['depth_m']:.1f} mm: do not run them"
            )
        if path["avoided"]:
            kinds = ", ".join(sorted({c["kind"] for c in path["avoided"]}))
            lines.append(
                f"{name}: {len(path['avoided'])} moves ({kinds}) touched something when they were "
                "tried, and are left out"
            )
        if path["leaning"]:
            lines.append(
                f"{name}: at {path['leaning']} waypoints the tool leans from the planned axis, by "
                f"{np.degrees(path['most_lean_rad']):.0f}° at most, as something is in its way"
            )
        if path["slower_than_feed_share"] > 0.1:
            lines.append(
                f"{name}: at {path['slower_than_feed_share']:.0%} of the waypoints the joints "
                "are too slow for the whole feed"
            )
    return lines


def figures(path: Mapping[str, Any]) -> list[str]:
    """A path's figures, one for each of `COLUMNS`."""
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
