"""How large a plan would be, estimated before planning, so that planning always ends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nrdf.errors import ProcessError
from nrdf.geometry.units import readable
from nrdf.surface.border import OWN
from nrdf.surface.patch import Patch
from nrdf.toolpath.size_limits import MOST_LINES, MOST_WAYPOINTS, in_words
from nrdf.toolpath.strategy import Strategy

_MOST_PLACES = 1_000_000  # at which lines are laid out, and the tool's footprint is looked at
_MOST_PAIRS = 1e7  # of a place and what its footprint reaches, or of places beside each other
_PARTS = (
    4.0  # of the radius, from one place of a footprint to the next (`nrdf.toolpath.sampled_path`)
)
_BESIDE = 2.5  # stepovers within which the next line is samples for there
_ROUNDED = 10.0  # places a stepover of a ring (`nrdf.toolpath.contour`)


@dataclass(frozen=True)
class PlanSize:
    """Estimates.

    area: m², of the region; length: m, of all lines of a pass; lines, waypoints: of all passes;
    nodes: points at which a pass's lines are laid out; samples: of its footprint; pairs: of those
    samples with what they reach.
    """

    area: float
    length: float
    lines: float
    waypoints: float
    nodes: float
    samples: float
    pairs: float


def estimate_size(patches: Sequence[Patch], strategy: Strategy) -> PlanSize:
    """What a strategy would plan on the patches of a region, about."""
    stepover, radius = strategy.stepover_m, strategy.tool_radius_m
    points = np.array([(patch.label == OWN).sum() for patch in patches])
    spacing = np.array([patch.spacing for patch in patches])
    area = float((points * spacing**2).sum())
    sweeps = 2.0 if strategy.trajectory == "cross-hatch" else 1.0
    length = sweeps * area / stepover
    lines = sum(max(_breadth(patch, strategy) / stepover, sweeps) for patch in patches)
    round_ = strategy.trajectory in ("contour", "spiral")
    nodes = _ROUNDED * length / stepover if round_ else length / (0.5 * float(spacing.min()))
    step = radius / _PARTS
    samples = length / step
    reach = _BESIDE * stepover + step
    beside = np.pi * reach**2 / (stepover * step)
    reached = min(np.pi * radius**2 / float(spacing.min()) ** 2, points.sum())
    return PlanSize(
        area=area,
        length=length,
        lines=strategy.passes * lines,
        waypoints=strategy.passes * (length / strategy.spacing_m + 2.0 * lines),
        nodes=nodes,
        samples=samples,
        pairs=samples * (min(beside, samples) + reached),
    )


def check_size(patches: Sequence[Patch], strategy: Strategy) -> None:
    """Raise ProcessError, saying what would be planned, for more than can be."""
    size = estimate_size(patches, strategy)
    stepover = f"stepover_m {strategy.stepover_m:g} ({readable('_m', strategy.stepover_m)})"
    region = f"on the region's {size.area:.3g} m²"
    if size.waypoints > MOST_WAYPOINTS or size.lines > MOST_LINES:
        raise ProcessError(
            f"about {in_words(size.waypoints)} waypoints on {in_words(size.lines)} lines would be "
            f"planned {region}, with {stepover}, spacing_m {strategy.spacing_m:g} "
            f"({readable('_m', strategy.spacing_m)}) and passes {strategy.passes}; at most "
            f"{in_words(MOST_WAYPOINTS)} on {in_words(MOST_LINES)} are. Give more stepover_m or "
            "spacing_m, fewer passes, or cut the region into several"
        )
    if size.nodes > _MOST_PLACES:
        raise ProcessError(
            f"{stepover} is too fine for a {strategy.trajectory} {region}: it would have to be "
            f"laid out at about {in_words(size.nodes)} places, at most {in_words(_MOST_PLACES)} "
            "are. Give more, or cut the region into several"
        )
    if size.samples > _MOST_PLACES or size.pairs > _MOST_PAIRS:
        radius = f"{strategy.tool_radius_m:g} ({readable('_m', strategy.tool_radius_m)})"
        raise ProcessError(
            f"tool.radius_m {radius} does not go with {stepover} {region}: lines of about "
            f"{in_words(size.length)} m would have to be looked at {in_words(size.samples)} times "
            "to tell what the footprint reaches. Give radius and stepover of one size"
        )


def _breadth(patch: Patch, strategy: Strategy) -> float:
    """How far lines lie side by side on a patch, m."""
    length, width, _ = patch.extent
    if strategy.trajectory in ("contour", "spiral"):
        return 0.5 * width
    if strategy.trajectory == "cross-hatch":
        return length + width
    return width if strategy.direction is None else length
