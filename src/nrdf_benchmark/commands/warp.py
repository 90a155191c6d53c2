"""`nrdf eval warp`: waypoints warped to other objects, against the exact truth."""

from __future__ import annotations

from typing import Literal

from nrdf.commands.console import console, progress_bar, show, table
from nrdf.io.bounds import Count


def warp(
    category: Literal["chair", "car", "plane", "table"],
    model: str | None = None,
    pairs: Count = 50,
    device: str = "cpu",
) -> None:
    """Warped waypoints against the exact truth of the parametric families.

    A raster on every region of a member that no training set holds is warped to another, as
    `nrdf transfer` does it. Distances are from the waypoints' true positions. Also how many
    regions that the other lacks are skipped.

    Example: nrdf eval warp --category chair

    Args:
        category: chair, car, plane or table.
        model: Zoo name, weight file or run; the category's model in the zoo unless given.
        pairs: Pairs of members.
        device: cpu, cuda, cuda:N or auto.
    """
    import numpy as np

    import nrdf
    from nrdf.process.transfer_result import MIN_CONFIDENCE
    from nrdf_benchmark.warp import evaluate_warp

    loaded = nrdf.load_model(model or category, device)
    with progress_bar(f"pairs of {category}s") as progress:
        found = evaluate_warp(loaded, category, pairs, progress)
    errors = np.concatenate(found.errors)
    shown = table("", f"{pairs} pairs, {category}: waypoints", "median", "90 %", "worst pair")
    cells = (np.median(errors), np.quantile(errors, 0.9), found.medians.max())
    shown.add_row("distance from the true position", *(f"{cell:.2%}" for cell in cells))
    show(shown)
    console.print(
        f"shares of the longest side, {len(errors)} waypoints; worst pair: by its median. "
        f"Of waypoints that have a true position {found.lost:.1%} are left out; of those that have "
        f"none {found.invented:.0%} are warped all the same."
    )
    absent = int((~found.present).sum())
    console.print(
        f"of {int(found.present.sum())} regions that targets have, "
        f"{found.kept(MIN_CONFIDENCE, True):.1%} are found with confidence {MIN_CONFIDENCE:g}"
        + (f"; of {absent} that they lack, {found.kept(MIN_CONFIDENCE, False):.0%}" * bool(absent))
    )
