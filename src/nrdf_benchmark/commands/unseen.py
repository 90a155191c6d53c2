"""`nrdf eval unseen`: methods on categories that a model has not seen."""

from __future__ import annotations

from typing import Literal

from nrdf.commands.console import console, progress_bar, show, table
from nrdf.commands.options import Folder
from nrdf.io.bounds import Count


def unseen(
    bsrc: Folder | None = None,
    objects: Folder | None = None,
    category: tuple[str, ...] = ("car", "plane", "table"),
    method: tuple[str, ...] = ("registration", "registration-model", "general"),
    model: tuple[str, ...] = (),
    labels: Literal["published", "corrected"] = "published",
    pairs: Count = 60,
) -> None:
    """Regions found on categories that a model has not seen.

    Mean CD-L1 over all pairs of a category: of BSRC's regions (docs/evidence/bsrc.md) where it has
    the category, else of labelled parts (docs/evidence/objects.md). Each method is compared with
    the first one pair by pair, with an interval of 95 % over the targets. On one core.
    `general` stands for weights of the general field that never saw a car, aircraft, table or
    desk; `--model general=general` takes the zoo's, which has seen all of them.

    Example: nrdf eval unseen --bsrc bsrc/ --objects objects/ --category car plane table

    Args:
        bsrc: BSRC's folder, with Chair, Car and plane in it.
        objects: Folder of labelled objects.
        category: Categories to measure on.
        method: Methods to run, the one to compare with first.
        model: METHOD=PATH of a weight file for a learned method.
        labels: Of BSRC, as published, or corrected (plane5's wings are swapped as published).
        pairs: At most so many pairs of each category, drawn at random.
    """
    import numpy as np

    from nrdf_benchmark.methods.registry import build_method, find_methods
    from nrdf_benchmark.unseen import (
        UNSEEN_WEIGHTS,
        compare,
        evaluate_unseen,
        read_unseen,
        unseen_pairs,
    )

    if "general" in method and not any(given.startswith("general=") for given in model):
        model = (*model, f"general={UNSEEN_WEIGHTS}")
    for name in category:
        specs = find_methods(method, name, model)
        methods = {spec.name: build_method(spec) for spec in specs}
        drawn = unseen_pairs(read_unseen(name, bsrc, objects, labels), pairs)
        with progress_bar(f"pairs of {name}s") as progress:
            results = evaluate_unseen(methods, drawn, progress)
        title = f"{name}, {len(drawn)} pairs: mean CD-L1"
        shown = table(title, "", "all", "found", "missed", f"below {method[0]}", "s a pair")
        for result in results:
            beside = compare(result, results[0], drawn)
            shown.add_row(
                result.method,
                f"{result.cd.mean():.4f}",
                f"{np.nanmean(result.found):.4f}",
                str(result.missed),
                f"{beside.lower:+.1%} ({beside.low:+.1%} to {beside.high:+.1%})",
                f"{np.median(result.cpu_s):.2f}",
            )
        show(shown)
    console.print(
        "all: a region found nowhere counts as 1; found: of those found somewhere; s a pair: "
        "processor seconds, median, the target encoded anew"
    )
