"""`nrdf eval presence`: how far regions can be believed, and what absent ones are told by."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from nrdf.commands.console import console, progress_bar, show, table
from nrdf.commands.options import Folder
from nrdf.commands.output_lock import lock_output

if TYPE_CHECKING:
    import numpy as np

    from nrdf.regions.model import Model
    from nrdf.scans.pose_scorer import PoseScorer
    from nrdf_benchmark.objects.retrieval import ObjectRetrieval
    from nrdf_benchmark.presence import Example


@lock_output("out")
def presence(
    out: Folder,
    objects: Folder | None = None,
    model: str = "chair",
    group: tuple[str, ...] = ("chair+stool",),
    seek: str | None = None,
    category: tuple[Literal["chair", "car", "plane"], ...] | None = None,
    pairs: int = 12,
    device: str = "cpu",
) -> None:
    """Fit the overlap that is to be expected of a region.

    Parts of labelled objects, and regions of pairs of family members that no training has seen, are
    sought whole and in simulated scans; a logistic regression tells from what a retrieval knows of
    itself how well they overlap with the truth, and which the target lacks. Shows its coefficients,
    to be compared with those in nrdf/regions/presence.py, what rules tell that were fitted on
    other products and pairs, and what the rule in use tells. Started again, it goes on where it
    was.

    Example: nrdf eval presence --objects objects/ --out runs/presence

    Args:
        out: Folder that keeps what was measured.
        objects: Folder of labelled objects, as of nrdf eval objects.
        group: Categories of labelled objects to take, joined by "+" where they share parts. Only
            those of the first are scanned as well, and aligned by the model.
        seek: Fit the rule of this model instead, on labelled objects, and on the families that are
            given: a zoo name, such as registration or general, or a weight file.
        model: Zoo name, weight file or run, for the labelled objects.
        category: Families: chair, car, plane, or several of them; without --seek chair and plane
            unless given. The zoo's cars are mapped by the general model, whose evidence is of
            another kind.
        pairs: Pairs of members of each family, about 10 s each on one core.
        device: cpu, cuda, cuda:N or auto.
    """
    from functools import partial

    import numpy as np

    import nrdf
    from nrdf.field.registration import REGISTRATION
    from nrdf.regions.presence import FIELD_RULE, REGISTRATION_RULE
    from nrdf_benchmark.presence import (
        OBJECT_STEP,
        choose_pairs,
        cross_validate,
        examples_of_members,
        examples_of_objects,
        fit,
        load_or_collect,
    )

    every: list[Example] = []
    seeker = nrdf.load_model(seek, device) if seek else None
    if objects is not None:
        retrieval, pairs_of_objects = _open_objects(objects, group, model, device)
        chosen = pairs_of_objects[::OBJECT_STEP]
        with progress_bar("parts of objects") as progress:
            for done, (key, other, views) in enumerate(chosen, 1):
                name = f"{key}-{other}".replace("/", "_")
                every += load_or_collect(
                    out, name, partial(examples_of_objects, retrieval, key, other, views, seeker)
                )
                progress(done, len(chosen))
    families = category or (() if seek else ("chair", "plane"))
    for name in families:
        scorer = None
        with progress_bar(f"pairs of {name}s") as progress:
            for done, pair in enumerate(choose_pairs(name, pairs), 1):

                def collect(name: str = name, pair: int = pair) -> list[Example]:
                    nonlocal scorer
                    scorer = scorer or _scorer(name, seeker or nrdf.load_model(name, device))
                    return examples_of_members(scorer, name, pair)

                every += load_or_collect(out, f"{name}-{pair:03d}", collect)
                progress(done, pairs)
    rule = fit(every)
    weights = ", ".join(f"{weight:.2f}" for weight in rule.weights)
    console.print(f"bias {rule.bias:.2f}; weights {weights}")
    _show("fitted on other products and pairs", every, cross_validate(every))
    by_registration = seeker is not None and seeker.preset == REGISTRATION
    used = REGISTRATION_RULE if by_registration else FIELD_RULE
    _show("by the rule in use", every, used.overlap(np.array([e.evidence for e in every])))


def _show(title: str, examples: list[Example], overlap: np.ndarray) -> None:
    """Table of what expected overlaps (n,) tell of examples, and how they go with the true ones."""
    import numpy as np

    from nrdf_benchmark.presence import summary

    heading = ("of", "told absent", "skipped", "overlap expected", "true")
    shown = table(title, "", "", "", *heading, texts=3)
    for source, kind, state, of, told, skipped, mean, true in summary(examples, overlap):
        counts = (str(of), str(told), str(skipped))
        shown.add_row(source, kind, state, *counts, f"{mean:.2f}", f"{true:.2f}")
    show(shown)
    there = np.array([not e.absent for e in examples])
    truth = np.array([e.overlap for e in examples])
    correlation = np.corrcoef(overlap[there], truth[there])[0, 1]
    console.print(f"correlation of expected and true overlap of what is there: {correlation:.2f}")


def _open_objects(
    folder: Path, groups: tuple[str, ...], model: str, device: str
) -> tuple[ObjectRetrieval, list[tuple[str, str, tuple[int, ...]]]]:
    """The objects, and their pairs with the views that the target is seen in."""
    from nrdf.field.zoo import find_weights
    from nrdf_benchmark.objects.dataset import read_objects
    from nrdf_benchmark.objects.retrieval import WHOLE, ObjectRetrieval, Settings
    from nrdf_benchmark.presence import VIEWS

    settings = Settings(folder.resolve(), find_weights(model).resolve(), device=device)
    pairs: list[tuple[str, str, tuple[int, ...]]] = []
    for number, group in enumerate(groups):
        keys = [item.key for item in read_objects(folder, tuple(group.split("+")))]
        views: tuple[int, ...] = (WHOLE,) if number else VIEWS
        pairs += [(key, other, views) for key in keys for other in keys if key != other]
    return ObjectRetrieval(settings), pairs


def _scorer(category: str, model: Model) -> PoseScorer:
    from nrdf.scans.pose_scorer import PoseScorer, family_prototypes

    return PoseScorer(model, family_prototypes(category))
