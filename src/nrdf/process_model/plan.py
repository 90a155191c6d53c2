"""Planning by the result: lines, run-off and feeds with which a region gets what it should have.

A few stepovers are tried, and the one with the most area within the tolerance is taken. The taught
plan, at one feed, stands beside it: both are measured in the same way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from nrdf.errors import ProcessError
from nrdf.process_model.feed_planner import (
    FeedLimits,
    plan_feeds,
    usual_slowness,
    within_acceleration,
)
from nrdf.process_model.plate_theory import best_stepover
from nrdf.process_model.removal import Pad
from nrdf.process_model.result import ResultMetrics, Target
from nrdf.process_model.result_model import ResultModel, Tool, cells_for, with_feeds
from nrdf.process_model.run_up import rooms_for, with_run_up
from nrdf.process_model.spray_profile import SprayProfile
from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.mesh_planner import plan_on_mesh
from nrdf.toolpath.strategy import LineOrder, Strategy
from nrdf.toolpath.types import Segment

_RUN_OFF = 0.3  # half-widths along the travel: slower ends do the rest
_STEADY = 3.0  # half-widths over which a gun's axis is averaged: an arm can turn its hand no faster
_STEPOVERS = (1.5, 1.0)
"""Times the stepover of theory that are tried. Lines farther apart are driven slower, which
leaves the arm more time to change its speed; finer ones are more even."""
_COARSE = 2.0  # times as long steps along the way for a first look
_SAME = 0.1  # stepovers that are no farther from each other are one
_GOOD = 0.98  # share within the tolerance with which no other lines are tried


@dataclass(frozen=True)
class PlannedResult:
    """A path planned by its result.

    segments: with their feeds; strategy: of their lines. model: what they leave; metrics: of that.
    taught: metrics of the taught plan, at the one feed that gives half of the region the target.
    """

    segments: tuple[Segment, ...]
    strategy: Strategy
    model: ResultModel
    metrics: ResultMetrics
    taught: ResultMetrics


def plan_by_result(
    region: RegionMesh,
    taught: Sequence[Segment],
    strategy: Strategy,
    tool: Tool,
    target: Target,
    limits: FeedLimits,
    replan: bool = True,
) -> PlannedResult:
    """The path whose result comes nearest to the target over the region.

    taught: the path as taught, which stays as it is but for its feeds where it may not be planned
    anew. Raises ProcessError where the target is out of reach, saying what is not.
    """
    check_reachable_at_all(tool)
    cells = cells_for(region, tool)
    before = ResultModel.of(region, taught, tool, cells)
    plain_feeds = constant_feeds(before, target, limits)
    plain = before.measure(target, plain_feeds)

    def rooms_of(lines: Sequence[Segment]) -> np.ndarray:
        if replan and isinstance(tool, SprayProfile):
            return rooms_for(lines, region.parent, tool.standoff_m)
        return np.zeros((sum(segment.kind == "process" for segment in lines), 2))

    def planned(lines: Sequence[Segment], own: Strategy, model: ResultModel) -> PlannedResult:
        feeds = feeds_for(model, target, limits)
        rooms = rooms_of(lines)
        return _driven(lines, own, model, feeds, rooms, target, limits, plain)

    if not replan:
        return planned(taught, strategy, before)
    best, fault = None, None
    for own in strategies_for(strategy, tool):
        lines = plan_on_mesh(region, own)
        try:
            made = planned(lines, own, ResultModel.of(region, lines, tool, cells))
        except ProcessError as error:  # other lines may have it in reach
            fault = error
            continue
        best = made if best is None or made.metrics.within > best.metrics.within else best
        if best.metrics.within >= _GOOD:
            return best
    if best is None:
        assert fault is not None
        raise fault
    if plain.within > best.metrics.within:  # what is taught is never made worse
        rooms = rooms_of(taught)
        made = _driven(taught, strategy, before, plain_feeds, rooms, target, limits, plain)
        best = made if made.metrics.within > best.metrics.within else best
    return best


def first_look(
    region: RegionMesh,
    lines: Sequence[Segment],
    strategy: Strategy,
    tool: Tool,
    target: Target,
    limits: FeedLimits,
) -> PlannedResult:
    """What lines as they are leave at one feed, the one that gives half of the region the target,
    in rough cells. Raises ProcessError for a pad that does not turn."""
    check_reachable_at_all(tool)
    cells = region.last("rough cells", tool, lambda: cells_for(region, tool, rough=True))
    model = ResultModel.of(region, lines, tool, cells, _COARSE)
    feeds = constant_feeds(model, target, limits)
    model = replace(model, moves=replace(model.moves, feeds_m_s=feeds))
    metrics = model.measure(target)
    return PlannedResult(with_feeds(lines, model.moves, feeds), strategy, model, metrics, metrics)


def _driven(
    lines: Sequence[Segment],
    strategy: Strategy,
    model: ResultModel,
    feeds: np.ndarray,
    rooms_m: np.ndarray,
    target: Target,
    limits: FeedLimits,
    taught: ResultMetrics,
) -> PlannedResult:
    """Lines driven at feeds (m,) of their moves, from rest and to rest within rooms (s, 2)."""
    segments = with_feeds(lines, model.moves, feeds)
    if model.flow_m3_s > 0.0:
        segments = with_run_up(segments, rooms_m, limits.acceleration_m_s2)
    model = replace(model, moves=replace(model.moves, feeds_m_s=feeds))
    return PlannedResult(segments, strategy, model, model.measure(target), taught)


def feeds_for(model: ResultModel, target: Target, limits: FeedLimits) -> np.ndarray:
    """Feeds (m,), m/s, with which a path comes nearest to a target. Raises ProcessError where that
    is out of reach."""
    check_in_reach(model, target, limits)
    inside = model.cells.inside
    return plan_feeds(
        model.on_region, model.fixed[inside], model.region_areas_m2, model.spill_m3(),
        target.value_m, target.tolerance_m, model.moves, limits,
    )  # fmt: skip


def constant_feeds(model: ResultModel, target: Target, limits: FeedLimits) -> np.ndarray:
    """One feed for all moves (m,), with which half of the region has the target; slower where the
    arm cannot be as fast."""
    inside = model.cells.inside
    slowness = usual_slowness(
        model.on_region, model.fixed[inside], model.region_areas_m2, target.value_m, limits
    )
    feeds = np.full(len(model.moves.lengths_m), 1.0 / slowness)
    return within_acceleration(feeds, model.moves, limits)


def strategies_for(strategy: Strategy, tool: Tool) -> list[Strategy]:
    """Lines for a tool that are worth a try, the likeliest first: as far apart as theory has them
    even on a plate, farther, and as taught; a gun's run off by a part of its half-width.

    The tool lifts between lines: where it turns without lifting it must slow down, and leaves too
    much at every reversal.
    """
    run_off, steady = strategy.run_off_m, strategy.steady_m
    if isinstance(tool, SprayProfile):
        run_off = _RUN_OFF * tool.ends_m[1]
        steady = max(steady, _STEADY * tool.ends_m[1])
    order: LineOrder = "one-way" if strategy.line_order == "one-way" else "snake"
    lines = replace(
        strategy, run_off_m=run_off, steady_m=steady, line_order=order, join_gap_m=0.0,
        constant_speed=False,
    )  # fmt: skip
    even = best_stepover(tool)
    tried = [times * even for times in _STEPOVERS]
    if not any(abs(strategy.stepover_m / stepover - 1.0) < _SAME for stepover in tried):
        tried.append(strategy.stepover_m)
    return [replace(lines, stepover_m=stepover) for stepover in tried]


def check_reachable_at_all(tool: Tool) -> None:
    """Raise ProcessError for a pad whose depth no feed changes."""
    if isinstance(tool, Pad) and tool.spindle_rad_s == 0.0:
        raise ProcessError(
            "a pad that does not turn takes off the same at every feed (depth goes with the way "
            "that it slides): give spindle_rad_s, or change force_n or passes instead of a target"
        )


def check_in_reach(model: ResultModel, target: Target, limits: FeedLimits) -> None:
    """Raise ProcessError where half of the region cannot have the target within the limits, with
    what it can have."""
    inside = model.cells.inside
    each = np.asarray(model.on_region.sum(axis=1)).ravel()
    fixed = model.fixed[inside]
    least, most = (
        _median(each / feed + fixed, model.region_areas_m2)
        for feed in (limits.most_m_s, limits.least_m_s)
    )
    if least - target.tolerance_m <= target.value_m <= most + target.tolerance_m:
        return
    low, high = 1e3 * limits.least_m_s, 1e3 * limits.most_m_s
    other = "more" if target.value_m > most else "less"
    what = "flow, passes or time" if model.flow_m3_s else "force, spindle speed, passes or time"
    raise ProcessError(
        f"a target of {1e6 * target.value_m:.4g} µm is out of reach: at feeds of {low:.4g} to "
        f"{high:.4g} mm/s half of the region gets {1e6 * most:.3g} µm at most and "
        f"{1e6 * least:.3g} µm at least; give a target between them, or a tool with {other} {what}"
    )


def _median(values: np.ndarray, areas_m2: np.ndarray) -> float:
    order = np.argsort(values)
    summed = np.cumsum(areas_m2[order])
    return float(values[order[int(np.searchsorted(summed, 0.5 * summed[-1]))]])
