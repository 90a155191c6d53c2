"""`nrdf eval process`: film on real meshes, planned by the result."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from nrdf.commands.console import console, progress_bar, show, table
from nrdf.commands.options import Metavar
from nrdf.io.bounds import Count


def process(
    meshes: tuple[Annotated[Path, Metavar("FOLDER")], ...],
    sample: Count | None = None,
    whole: bool = False,
    each: bool = False,
    arm: bool = False,
) -> None:
    """Film thickness planned by the result, beside the taught plan at one feed.

    A target of 60 ± 6 µm, on the upper side of seats, table tops, bonnets and roofs, the front of
    backs, and meshes that are one region, wherever the gun's footprint fits. Film is computed on
    the mesh that was given. docs/evidence/process.md defines the figures.

    Example: nrdf eval process --meshes objects/ikea shapes/car --sample 8

    Args:
        meshes: Folders of meshes, or mesh files, as for nrdf eval toolpaths.
        sample: Only so many meshes of each folder, evenly chosen.
        whole: All of each labelled part, its edges and far side too.
        each: A row for each region as well.
        arm: The simulated arm executes each plan, and what it leaves is measured too.
    """
    from nrdf_benchmark.mesh_paths.targets import target_sources
    from nrdf_benchmark.process_results import evaluate_plate, evaluate_regions, summary

    flat = evaluate_plate()
    console.print(
        f"flat plate of 0.5 m, variation inside a margin of the fan's half-width (bar 3 %): "
        f"planned {flat.planned:.1%}, at one feed {flat.constant:.1%}; theory of an endless plate "
        f"at the best constant stepover, {1e3 * flat.stepover_m:.0f} mm: {flat.theory:.1%}"
    )
    sources = target_sources(meshes, sample)
    with progress_bar("regions") as progress:
        results = evaluate_regions(sources, whole, arm, progress)
    if each:
        rows = table("\neach region", "", "", "cells", "within", "taught", "variation", "taught",
                     "overspray", "taught", "s", texts=2)  # fmt: skip
        for r in results:
            if r.planned is None or r.taught is None:
                continue
            pairs = [(r.planned.within, r.taught.within), (r.planned.variation, r.taught.variation),
                     (r.planned.overspray, r.taught.overspray)]  # fmt: skip
            cells = [f"{value:.1%}" for pair in pairs for value in pair]
            rows.add_row(r.target, r.region, str(r.cells), *cells, f"{r.seconds:.1f}")
        show(rows)
    if arm:
        rows = table("\nexecuted by the simulated arm", "", "", "within", "less", "more",
                     "variation", "overspray", "reached", "s", "s planned", texts=2)  # fmt: skip
        for r in results:
            if r.executed is None or r.planned is None:
                continue
            left = r.executed.metrics
            shares = (left.within, left.below, left.above, left.variation, left.overspray,
                      r.executed.reached)  # fmt: skip
            cells = [f"{value:.1%}" for value in shares]
            rows.add_row(r.target, r.region, *cells, f"{left.seconds:.0f}",
                         f"{r.planned.seconds:.0f}")  # fmt: skip
        show(rows)
    what = "whole parts" if whole else "one side of each part"
    shown = table(f"\n{what}, {len(results)} regions", "", "bar", "met by", "median", "worst",
                  "taught, median")  # fmt: skip
    for row in summary(results):
        shown.add_row(*row)
    show(shown)
    for r in results:
        if r.error:
            console.print(f"{r.target}, {r.region}: no path: {r.error}")
        if r.arm_error:
            console.print(f"{r.target}, {r.region}: not executed: {r.arm_error}")
