"""Warnings about a planned tool path, from its metrics."""

from __future__ import annotations

import numpy as np

from nrdf.geometry.units import readable
from nrdf.process.process import Process
from nrdf.surface.tool_clearance import needed_clearance
from nrdf.toolpath.metrics import ToolPathMetrics
from nrdf.toolpath.region_samples import NO_CLEARANCE

_LEAST_LEFT_OUT = 0.001
_MOST_UNREACHED = 0.03
_LARGEST_STEP = 2.0  # times the spacing of waypoints
_LARGEST_TURN_RAD = np.radians(30.0)
_WIDEST_LINES = 1.15  # times the stepover
_FARTHEST_M = 0.001
_STEEPEST_RAD = np.radians(5.0)


def path_warnings(process: Process, metrics: ToolPathMetrics) -> list[str]:
    """What a person should look at before a path runs on a robot."""
    lines = []
    if metrics.left_out[NO_CLEARANCE] > _LEAST_LEFT_OUT:
        needed = needed_clearance(process.tool.clearance_m, process.tool.radius_m)
        clearance = readable("clearance_m", needed)
        lines.append(
            f"{metrics.left_out[NO_CLEARANCE]:.1%} of the region has less than {clearance} free "
            "before it, and is left out"
        )
    if metrics.unreached > _MOST_UNREACHED:
        lines.append(
            f"the tool does not reach {metrics.unreached:.1%} of the region, beside what is left "
            "out"
        )
    worst, stepover = metrics.line_spacing_worst_m, process.distance_between_lines_m
    if process.trajectory != "taught" and worst is not None and worst > _WIDEST_LINES * stepover:
        lines.append(
            f"lines are up to {readable('spacing_m', worst)} apart; "
            f"{readable('stepover_m', stepover)} were asked for"
        )
    allowed = max(_LARGEST_STEP * process.spacing_m, process.resample_step_m)
    if process.trajectory != "taught" and metrics.step_worst_m > allowed:
        step, requested = (readable("_m", x) for x in (metrics.step_worst_m, process.spacing_m))
        lines.append(f"a step of {step} between neighbouring waypoints; {requested} were asked for")
    if metrics.turn_worst_rad > _LARGEST_TURN_RAD:
        turn = readable("_rad", metrics.turn_worst_rad)
        lines.append(f"the tool's axis turns by {turn} between neighbouring waypoints")
    if metrics.body_touches and metrics.body_touches_at_m is not None:
        place = ", ".join(f"{1e3 * x:.0f}" for x in metrics.body_touches_at_m)
        lines.append(
            f"the tool's body would touch the object at {metrics.body_touches:.1%} of the places "
            f"along the lines, first at ({place}) mm"
        )
    lines += _distance_warnings(process, metrics)
    if metrics.axis_error_99_rad > _STEEPEST_RAD and process.trajectory != "taught":
        error = readable("error_rad", metrics.axis_error_99_rad)
        lines.append(f"1 % of the waypoints have a tool axis more than {error} off")
    return lines


def _distance_warnings(process: Process, metrics: ToolPathMetrics) -> list[str]:
    """By the object as it was given where that is known, else by the surface planned on."""
    planned, true = metrics.surface_distance_99_m, metrics.true_distance_99_m
    if true is not None and true > max(_FARTHEST_M, metrics.resolution_m or 0.0):
        away = readable("_m", true)
        return [f"1 % of the way on the surface is more than {away} off {metrics.compared_with}"]
    if true is None and planned > _FARTHEST_M and process.trajectory != "taught":
        away = readable("_m", planned)
        return [f"1 % of the waypoints are more than {away} off the surface planned on"]
    return []
