"""`nrdf eval toolpaths`: how well tool paths are planned."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from nrdf.commands.console import console, progress_bar, show, table


def toolpaths(
    category: Literal["chair", "car", "plane"] = "chair",
    bsrc: Path | None = None,
    members: int = 6,
    trajectory: Literal["raster", "cross-hatch", "spiral", "contour"] = "raster",
    stepover_mm: float = 25.0,
    radius_mm: float = 25.0,
) -> None:
    """Tool paths planned on regions known exactly: coverage, spacing, distance, angles.

    Every object is 0.9 m long and has 8192 points. A region's own points tell what is covered.

    Example: nrdf eval toolpaths --category chair --bsrc bsrc/

    Args:
        category: What the objects are.
        bsrc: BSRC's folder; its objects instead of family members.
        members: Members of the parametric family.
        trajectory: raster, cross-hatch, spiral or contour.
        stepover_mm: Distance between lines.
        radius_mm: Radius of the tool's footprint.
    """
    import numpy as np

    from nrdf.benchmark.toolpaths import BARS, plan_regions
    from nrdf.process.plan import Strategy

    strategy = Strategy(
        trajectory=trajectory, stepover_m=stepover_mm / 1e3, tool_radius_m=radius_mm / 1e3
    )
    with progress_bar("objects") as progress:
        found, faults = plan_regions(category, strategy, members, bsrc, progress)
    shown = table("", "region", "planned", "coverage", "widest lines", "off surface", "axis off")
    for name in dict.fromkeys(item.region for item in found):
        all_of = [item.measures for item in found if item.region == name]
        widest = [m.line_spacing_worst_m for m in all_of if m.line_spacing_worst_m is not None]
        shown.add_row(
            name,
            str(len(all_of)),
            f"{min(m.coverage for m in all_of):.1%}",
            f"{max(widest) / strategy.stepover_m:.2f} x" if widest else "–",
            f"{1e3 * max(m.surface_distance_99_m for m in all_of):.2f} mm",
            f"{np.degrees(max(m.axis_error_99_rad for m in all_of)):.1f}°",
        )
    show(shown)
    console.print("the worst of each region; off surface and axis off: of 99 % of waypoints")
    met = [item.meets(strategy.stepover_m) for item in found]
    for name, said in BARS.items():
        share = np.mean([kept[name] for kept in met]) if met else 0.0
        console.print(f"{said}: {share:.1%} of {len(found)} regions")
    seconds = np.median([item.seconds for item in found]) if found else 0.0
    console.print(f"{seconds:.2f} s to plan a region (median, of one core)")
    for fault in faults:
        console.print(f"not planned: {fault}")
