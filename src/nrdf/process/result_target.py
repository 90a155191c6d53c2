"""From a process with a target to what the process model takes, and the path planned by it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from nrdf.errors import ProcessError
from nrdf.process.process import Process
from nrdf.process.strategy import strategy_of
from nrdf.process_model.feed_planner import FeedLimits
from nrdf.process_model.plan import PlannedResult, first_look, plan_by_result
from nrdf.process_model.removal import Pad
from nrdf.process_model.result import Target
from nrdf.process_model.result_model import Tool
from nrdf.process_model.spray_profile import SprayProfile
from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.types import Segment

_UM = 1e-6
LEAST_WITHIN = 0.95
"""Share of the area within the tolerance, below which there is a warning."""


@dataclass(frozen=True)
class ResultSettings:
    """What is wanted of a process, and with what. most_m: what may be there at most, m, or None."""

    tool: Tool
    target: Target
    limits: FeedLimits
    most_m: float | None = None


def result_settings(process: Process) -> ResultSettings | None:
    """Of a process that has a target; None for any other."""
    amount = process.thickness_um or process.removal_um
    if amount is None:
        return None
    limits = FeedLimits(**process.feed_limits.model_dump())
    target = Target(_UM * amount.value, _UM * amount.tolerance)
    most = None if amount.most is None else _UM * amount.most
    return ResultSettings(_tool(process), target, limits, most)


def plan_result(
    region: RegionMesh, process: Process, taught: Sequence[Segment], replan: bool
) -> PlannedResult | None:
    """The path of a process planned by its target; None where it has none.

    taught: its path at one feed; replan: whether other lines may be taken. For a rough region
    neither lines nor feeds are planned (`nrdf.process_model.plan.first_look`). Raises ProcessError
    where the target is out of reach.
    """
    settings = result_settings(process)
    if settings is None:
        return None
    name = "thickness_um" if process.thickness_um else "removal_um"
    asked = strategy_of(process), settings.tool, settings.target, settings.limits
    try:
        if region.rough:
            return first_look(region, taught, *asked)
        return plan_by_result(region, taught, *asked, replan)
    except ProcessError as error:
        raise ProcessError(f"{name}: {error}") from None


def with_lines_of(process: Process, planned: PlannedResult) -> Process:
    """A process that is planned anew, with the lines that its result asks for."""
    if process.trajectory == "taught":
        return process
    lines = planned.strategy
    names = ("stepover_m", "steady_m", "run_off_m", "line_order", "join_gap_m", "constant_speed")
    changes: dict[str, object] = {name: getattr(lines, name) for name in names}
    return process.model_copy(update={**changes, "overlap": None})


def result_warnings(process: Process, planned: PlannedResult | None) -> list[str]:
    """What a person should look at: too little within the tolerance, more than there may be."""
    settings = result_settings(process)
    if planned is None or settings is None:
        return []
    metrics, target, lines = planned.metrics, settings.target, []
    if metrics.within < LEAST_WITHIN:
        wanted = f"{1e6 * target.value_m:.4g} ± {1e6 * target.tolerance_m:.4g} µm"
        lines.append(
            f"{metrics.within:.1%} of the region will have {wanted}; {metrics.below:.1%} less, "
            f"{metrics.above:.1%} more"
        )
    if settings.most_m is not None:
        model = planned.model
        values = model.values()[model.cells.inside]
        over = values > settings.most_m
        share = float(model.region_areas_m2[over].sum() / model.region_areas_m2.sum())
        if share > 0.0:
            what = "sanded through" if process.removal_um else "too thick"
            lines.append(
                f"{share:.2%} of the region is {what}: more than {1e6 * settings.most_m:.4g} µm, "
                f"up to {1e6 * float(values.max()):.4g} µm"
            )
    return lines


def _tool(process: Process) -> Tool:
    profile, pad = process.tool.profile, process.tool.pad
    if process.thickness_um is not None and profile is not None:
        given = profile.model_dump()
        given["standoff_m"] = profile.standoff_m or process.standoff_m
        return SprayProfile(**given)
    assert pad is not None and process.force_n is not None  # the process's own rules
    return Pad(
        radius_m=process.tool.radius_m,
        force_n=process.force_n,
        spindle_rad_s=process.spindle_rad_s or 0.0,
        **pad.model_dump(),
    )
