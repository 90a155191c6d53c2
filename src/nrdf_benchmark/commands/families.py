"""`nrdf eval families`: correspondence against the exact truth of the parametric families."""

from __future__ import annotations

from typing import Literal

from nrdf.commands.console import console, progress_bar, show, table
from nrdf.io.bounds import Count


def families(
    category: Literal["chair", "car", "plane", "table"],
    model: str | None = None,
    pairs: Count = 50,
    device: str = "cpu",
) -> None:
    """The field against the exact truth of the parametric families.

    Mean distance of C's prediction from the exact corresponding point, on pairs of parametric
    shapes that no training set holds, beside that of a bounding-box copy.

    Example: nrdf eval families --category chair

    Args:
        category: chair, car, plane or table.
        model: Zoo name, weight file or run; the category's model in the zoo unless given.
        pairs: Pairs of members.
        device: cpu, cuda, cuda:N or auto.
    """
    import numpy as np

    import nrdf
    from nrdf_benchmark.families import evaluate_family

    loaded = nrdf.load_model(model or category, device)
    with progress_bar(f"pairs of {category}s") as progress:
        found = evaluate_family(loaded, category, pairs, progress)
    shown = table("", f"{pairs} pairs, {category}", "mean error", "median pair", "worst pair")
    for name, error in (("C", found.field), ("bounding-box copy", found.box)):
        shown.add_row(name, *(f"{f(error):.4f}" for f in (np.mean, np.median, np.max)))
    show(shown)
    console.print(
        f"C is {found.ratio:.1f} times closer; lengths are shares of the longest side. "
        f"{found.shared.mean():.0%} of a reference's surface exists on its target."
    )
