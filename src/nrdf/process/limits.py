"""Limits on a transfer's result, and the warnings that `nrdf transfer --strict` refuses."""

from __future__ import annotations

from dataclasses import dataclass

from nrdf.geometry.units import readable
from nrdf.io.bounds import FRACTION, NON_NEGATIVE
from nrdf.process.transfer_result import FoundRegion, TransferResult
from nrdf.regions.presence import ABSENT
from nrdf.toolpath.metrics import ToolPathMetrics

LOW_CONFIDENCE = 0.4
"""A region found with less confidence than this gets a warning."""
SURELY_ABSENT = 0.9
"""From this confidence on, an absent region gets no warning."""


def strict_warnings(result: TransferResult) -> list[str]:
    """Warnings about the target (pose, unit, kind), then about its regions.

    A region gets a warning where it was found with little confidence, and where it was skipped
    but may be there. `nrdf transfer --strict` ends with exit code 3 where there are any.
    """
    regions = ((name, _region_warning(region)) for name, region in result.regions.items())
    kind = () if result.kind is None else result.kind.warnings
    # An aligned scan's own warnings already contain those about its kind.
    about_target = dict.fromkeys((*result.target_warnings, *kind))
    return [*about_target, *(f"region '{name}': {warning}" for name, warning in regions if warning)]


def _region_warning(region: FoundRegion) -> str:
    match = region.match
    if not region.missing:
        warning = f"doubtful: confidence {match.score:.2f}; look at it"
        return warning if match.score < LOW_CONFIDENCE else ""
    absent = match.presence.reason == ABSENT and match.presence.confidence >= SURELY_ABSENT
    known = absent or match.method == "marked"
    return "" if known else f"perhaps there all the same: {region.missing}"


@dataclass(frozen=True)
class Limits:
    """Limits on each tool path, in SI; None: no limit. The cycle time is that of the whole job.

    min_coverage: of the whole region that was found. max_surface_distance_m: from the object as it
    was given, or from the surface planned on where nothing else is known. require_all: every
    process needs a tool path. any_kind: also accept a target that does not look like the
    knowledge's kind of object, or does not stand upright and face forward.

    Raises ConfigError for a limit that is not finite, below 0, or a share above 1.
    """

    min_coverage: float | None = None
    max_line_spacing_m: float | None = None
    max_surface_distance_m: float | None = None
    max_axis_error_rad: float | None = None
    max_step_m: float | None = None
    max_turn_rad: float | None = None
    max_cycle_time_s: float | None = None
    require_all: bool = False
    any_kind: bool = False

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if value is not None:
                (FRACTION if name == "min_coverage" else NON_NEGATIVE).check(name, value)

    def broken(self, result: TransferResult) -> list[str]:
        """A message for each limit that is not met: where, and by how much."""
        lines = []
        if result.kind is not None and not self.any_kind:
            lines += [f"{w} (--any-kind: take it all the same)" for w in result.kind.warnings]
        for step in result.paths:
            where = f"region '{step.region}', {step.process.label}"
            if step.metrics is None:
                lines += [f"{where}: there is no tool path: {step.reason}"] * self.require_all
            else:
                lines += [f"{where}: {what}" for what in self._broken_by(step.metrics)]
        total = sum(step.metrics.cycle_time_s for step in result.paths if step.metrics)
        if self.max_cycle_time_s is not None and total > self.max_cycle_time_s:
            lines.append(f"the cycle time is {total:.1f} s, above {self.max_cycle_time_s:g} s")
        return lines

    def _broken_by(self, metrics: ToolPathMetrics) -> list[str]:
        lines = []
        if self.min_coverage is not None and metrics.coverage < self.min_coverage:
            lines.append(
                f"the coverage of the whole region is {metrics.coverage:.3f}, below "
                f"{self.min_coverage:g} (left out: {sum(metrics.left_out.values()):.3f}, "
                f"unreached: {metrics.unreached:.3f})"
            )
        off, from_what = metrics.true_distance_worst_m, metrics.compared_with
        if off is None:
            off, from_what = metrics.surface_distance_worst_m, "the surface planned on"
        for what, name, value, limit in (
            ("worst line spacing", "spacing_m", metrics.line_spacing_worst_m,
             self.max_line_spacing_m),
            (f"worst distance from {from_what}", "distance_m", off, self.max_surface_distance_m),
            ("tool axis' error (99th percentile)", "error_rad", metrics.axis_error_99_rad,
             self.max_axis_error_rad),
            ("largest step between waypoints", "step_m", metrics.step_worst_m, self.max_step_m),
            ("largest turn of the tool's axis between waypoints", "turn_rad",
             metrics.turn_worst_rad, self.max_turn_rad),
        ):  # fmt: skip
            if limit is not None and value is not None and value > limit:
                excess = f"{readable(name, value)}, above {readable(name, limit)}"
                lines.append(f"the {what} is {excess}")
        return lines
