"""`nrdf eval toolpaths`: rasters planned on known regions."""

from __future__ import annotations

from typing import Literal

from nrdf.commands.console import console, progress_bar, show, table
from nrdf.commands.options import Folder
from nrdf.io.bounds import NonNegative, NonNegativeCount


def toolpaths(
    category: Literal["chair", "car", "plane", "table"],
    data: Folder | None = None,
    members: NonNegativeCount = 10,
    trajectory: Literal["raster", "cross-hatch", "spiral", "contour"] = "raster",
    edge_margin_mm: NonNegative = 0.0,
) -> None:
    """Tool paths planned on known regions, measured.

    Objects of 0.9 m, a tool radius of 25 mm, a stepover of 25 mm: on every region of members that
    no training set holds and, with --data, of the Benchmark for Surface Region Correspondence.
    Apart from all regions, those that the tool's footprint fits into.

    Example: nrdf eval toolpaths --category chair --data bsrc/

    Args:
        category: chair, car, plane or table.
        data: BSRC's folder, with Chair, Car and plane in it.
        members: Members of the parametric family.
        trajectory: raster, cross-hatch, spiral or contour.
        edge_margin_mm: Margin along the regions' borders.
    """
    from dataclasses import replace

    import numpy as np

    from nrdf_benchmark.toolpaths import (
        STRATEGY,
        bsrc_objects,
        evaluate_toolpaths,
        family_members,
        summarize,
    )

    strategy = replace(STRATEGY, trajectory=trajectory, edge_margin_m=edge_margin_mm / 1e3)
    sources = {"families": family_members(category, members)}
    if data is not None:
        sources["BSRC"] = bsrc_objects(data, category)
    for source, objects in sources.items():
        with progress_bar(f"{category}s, {source}") as progress:
            results = evaluate_toolpaths(objects, strategy, lambda n: progress(n, n))
        for what, chosen in (
            ("all regions", results),
            ("those that the footprint fits into", [r for r in results if r.wide]),
        ):
            title = f"\n{category}, {source}, {trajectory}: {what}, {len(chosen)}"
            shown = table(title, "", "bar", "met by", "median", "worst")
            for metric in summarize(chosen, strategy):
                cells = (np.median(metric.values), metric.worst)
                met = f"{metric.met.mean():.0%}" if metric.bar else ""
                shown.add_row(metric.name, metric.bar, met, *(f"{cell:.2f}" for cell in cells))
            show(shown)
        seconds = 8.0 * float(np.mean([r.seconds for r in results]))
        console.print(f"planning takes {seconds:.2f} s of CPU time for 8 regions")
