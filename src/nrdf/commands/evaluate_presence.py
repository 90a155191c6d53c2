"""`nrdf eval presence`: what absent regions are told by."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from nrdf.bounds import Count
from nrdf.commands.console import console, progress_bar, show, table
from nrdf.commands.one_run import one_run_at

if TYPE_CHECKING:
    from nrdf.benchmark.scans import RegionFigure
    from nrdf.scans.judge import Judge


@one_run_at("out")
def presence(
    out: Path,
    category: tuple[Literal["chair", "car", "plane"], ...] = ("chair", "car", "plane"),
    pairs: Count = 25,
    device: str = "cpu",
) -> None:
    """Fit what tells absent regions, on scans of family members.

    Regions of pairs of members that no training has seen are sought whole and in simulated scans;
    a logistic regression tells those that the target lacks. Shows its coefficients, to be compared
    with those in nrdf/regions/presence.py, and what is told by the rule in use, and by rules that
    were fitted on other pairs. Started again, it goes on where it was.

    Example: nrdf eval presence --pairs 25 --out runs/presence

    Args:
        out: Folder that keeps what was measured, a file each pair.
        category: chair, car, plane, or several of them.
        pairs: Pairs of members of each category, about 10 s each on one core.
        device: cpu, cuda, cuda:N or auto.
    """
    from functools import partial

    from nrdf.benchmark.presence import collect, cross_validate, fit

    every: list[RegionFigure] = []
    for name in category:
        with progress_bar(f"pairs of {name}s") as progress:
            every += collect(partial(_judge, name, device), name, pairs, out, progress)
    rule = fit(every)
    weights = ", ".join(f"{weight:.2f}" for weight in rule.weights)
    console.print(f"bias {rule.bias:.2f}; weights of existence and distance: {weights}")
    shown = table("", "told absent", "", "as in use", "fitted on other pairs", "of")
    for kind, state, in_use, refitted, of in cross_validate(every):
        shown.add_row(kind, state, str(in_use), str(refitted), str(of))
    show(shown)


def _judge(category: str, device: str) -> Judge:
    import nrdf
    from nrdf.scans.judge import Judge

    return Judge(nrdf.load_model(category, device))
