"""From a process of the knowledge file to what the planner takes, and the tool path around it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nrdf.process.process import Process
from nrdf.toolpath.strategy import LARGEST_TURN_RAD_M, RESAMPLE_TURN_RAD, Strategy
from nrdf.toolpath.types import Segment, ToolPath


def strategy_of(process: Process, direction: np.ndarray | None = None) -> Strategy:
    """The planner's strategy for a process.

    `direction` (3,) replaces the process's own, which is in the reference's frame. A taught
    process has a strategy too, for measuring it: its trajectory is of no meaning.
    """
    given = process.direction if direction is None else direction
    return Strategy(
        trajectory="raster" if process.trajectory == "taught" else process.trajectory,
        direction=None if given is None else np.asarray(given, float),
        stepover_m=process.distance_between_lines_m,
        spacing_m=process.spacing_m,
        edge_margin_m=process.edge_margin_m,
        tool_radius_m=process.tool.radius_m,
        clearance_m=process.tool.clearance_m,
        lead_rad=process.lead_rad,
        tilt_rad=process.tilt_rad,
        standoff_m=process.standoff_m,
        passes=process.passes,
        feed_m_s=process.feed_m_s,
        force_n=process.force_n,
        dwell_s=process.dwell_s,
        approach_distance_m=process.approach.distance_m,
        approach_angle_rad=process.approach.angle_rad,
        approach_feed_m_s=process.approach.feed_m_s,
        retract_distance_m=process.retract.distance_m,
        retract_angle_rad=process.retract.angle_rad,
        retract_feed_m_s=process.retract.feed_m_s,
        direction_mode=process.direction_mode or "taught",
        start=process.start,
        origin_m=None if process.origin_m is None else np.asarray(process.origin_m, float),
        line_order=process.order_of_lines,
        heading=process.heading,
        steady_m=process.steady_m,
        run_off_m=process.run_off_m,
        run_off_height_m=process.run_off_height_m,
        lead_in_radius_m=process.lead_in_radius_m,
        lead_out_radius_m=process.lead_out_radius_m,
        offset_m=process.offset_m,
        drag_m=process.drag_m,
        edge_contact_m=process.edge_contact_m,
        largest_turn_rad_m=process.largest_turn_rad_m or LARGEST_TURN_RAD_M,
        chord_error_m=process.chord_error_m,
        resample_step_m=process.resample_step_m,
        resample_turn_rad=process.resample_turn_rad or RESAMPLE_TURN_RAD,
        minimum_length_m=process.minimum_length_m,
        join_gap_m=process.join_gap_m,
        constant_speed=process.constant_speed,
        body_radius_m=process.tool.radius_of_body_m,
        body_length_m=process.tool.body_length_m or 0.0,
    )


def tool_path(region: str, process: Process, segments: Sequence[Segment]) -> ToolPath:
    """Segments on a region as the tool path of a process, with its strategy."""
    return ToolPath(
        region=region,
        process=process.label,
        tool=process.tool.name,
        tool_radius_m=process.tool.radius_m,
        segments=tuple(segments),
        spindle_rad_s=process.spindle_rad_s,
        parameters=dict(process.parameters),
        tcp_m=process.tool.tcp_m,
        tcp_quaternion_xyzw=process.tool.tcp_quaternion_xyzw,
        force_tolerance_n=process.force_tolerance_n,
        strategy=strategy_of(process),
        process_kind=process.kind,
    )
