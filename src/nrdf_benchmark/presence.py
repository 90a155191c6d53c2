"""How the overlap that is to be expected of a region is told from evidence: the regression behind
`nrdf.regions.presence`.

Fitted on parts of labelled real objects, and on regions of pairs of family members that neither the
benchmark of scans nor training has; whole, and in simulated scans.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from pydantic import TypeAdapter, ValidationError
from scipy.optimize import minimize

from nrdf.errors import DataError
from nrdf.io.atomic import output_errors, write_atomically
from nrdf.io.files import read_file
from nrdf.process.transfer_result import MIN_CONFIDENCE
from nrdf.regions.model import Model
from nrdf.regions.presence import SURELY_ABSENT, Evidence, PresenceRule
from nrdf.scans.pose_scorer import PoseScorer
from nrdf.shapes.families import get_family
from nrdf_benchmark.objects.pairs import ABSENT, THERE, part_iou, state_of
from nrdf_benchmark.objects.retrieval import WHOLE, ObjectRetrieval
from nrdf_benchmark.scans import score_regions

FIRST_SEED = 1_000_000
"""Of the family members that are fitted on."""
VIEWS = (WHOLE, 3, 1)
FITTED = ("whole", "full", "canonical", "3 views")
"""Kinds that are fitted on: what a single view hides would make all regions look doubtful."""
OBJECT_STEP = 3
"""One in so many pairs of labelled objects is taken."""
_CHOICE = 5
_RIDGE = 1.0  # keeps the weights of evidence that says the same from growing against each other
_ABSENT_WEIGHT = 4.0  # to call a part found that is not there is worse than to doubt one that is


@dataclass(frozen=True)
class Example:
    """One region on one target. source: where it is from, such as "ikea" or "family chair"; kind:
    how the target was seen; target: product or pair, which is in one fold as a whole, and so is
    reference; overlap: intersection over union of what was found and the true region, 0 where
    the target lacks it; absent: whether it does."""

    source: str
    kind: str
    reference: str
    target: str
    region: str
    overlap: float
    absent: bool
    evidence: tuple[float, ...]


_ROWS = TypeAdapter(list[Example])
_LARGEST = 1 << 26  # bytes of a file of examples


def examples_of_objects(
    retrieval: ObjectRetrieval,
    reference: str,
    target: str,
    views: Sequence[int] = VIEWS,
    model: Model | None = None,
) -> list[Example]:
    """Every part of one labelled object, sought on another by a model, whole and in scans.

    model: the retrieval's, which aligns the scans, unless given.
    """
    model = model or retrieval.model
    regions, cloud = retrieval.regions(reference), retrieval.whole_cloud(reference).cloud
    encoded_reference, found = model.set_reference(cloud), []
    for number in views:
        seen, truth = retrieval.target_cloud(target, number), retrieval.truth(target)
        for name, match in encoded_reference.retrieve_all(
            regions, seen.seen_by(model), drop_absent=False, check=False
        ).items():
            state = state_of(name, truth, seen.labelled)
            if state not in (THERE, ABSENT):
                continue
            indices = match.indices
            if seen.aligned is not None:
                indices = seen.aligned.cleaned.kept[indices]
            overlap = 0.0
            if state == THERE:
                overlap = part_iou(indices, name, retrieval.labels, seen.labelled)
            kind = {WHOLE: "whole", 1: "1 view"}.get(number, f"{number} views")
            evidence = match.presence.evidence or ()
            found.append(
                Example(
                    "objects", kind, reference, target, name, overlap, state == ABSENT, evidence
                )
            )
    return found


def examples_of_members(scorer: PoseScorer, category: str, pair: int) -> list[Example]:
    """Every region of one member of a family, sought on another by the scorer's model, whole and
    in scans."""
    results = score_regions(scorer, category, pair, FIRST_SEED, drop_absent=False)
    names = f"{category} {2 * pair}", f"{category} {2 * pair + 1}"
    return [
        Example(
            f"family {category}", f.kind, *names, f.region, 0.0 if f.state == "absent" else f.iou,
            f.state == "absent", f.evidence,
        )
        for f in results
        if f.state in ("there", "absent") and f.evidence
    ]  # fmt: skip


def load_or_collect(folder: Path, name: str, collect: Callable[[], list[Example]]) -> list[Example]:
    """What `collect` gives, cached in the file `name`.json of a folder, and not measured again.

    Raises OutputError if it cannot be written, DataError for a file that is damaged.
    """
    path = folder / f"{name}.json"
    if not path.is_file():
        with output_errors(folder):
            folder.mkdir(parents=True, exist_ok=True)
        write_atomically(path, [json.dumps([asdict(e) for e in collect()]).encode()])
    try:
        return _ROWS.validate_json(read_file(path, DataError, _LARGEST))
    except ValidationError as error:
        fault = error.errors(include_url=False)[0]["msg"]
        raise DataError(f"{path} is damaged ({fault}); delete it and start again") from None


def choose_pairs(category: str, count: int) -> list[int]:
    """Numbers of pairs of family members to measure: of five times as many, those first whose
    target lacks most of the regions that its reference has."""
    family = get_family(category)
    lacks = []
    for pair in range(_CHOICE * count):
        reference, target = (
            {*family.region_of(surface.coordinates)}
            for surface in (
                family.member(FIRST_SEED + 2 * pair + i).sample_surface(1024, rng)
                for i, rng in enumerate(map(np.random.default_rng, (0, 1)))
            )
        )
        lacks.append(len(reference - target - {""}))
    return sorted(np.argsort(-np.array(lacks), kind="stable")[:count].tolist())


def fit(examples: Sequence[Example]) -> PresenceRule:
    """The rule whose expected overlaps are likeliest, each source and kind counting alike.

    Raises DataError where no part is absent, or none is there.
    """
    examples = [e for e in examples if e.kind in FITTED]
    evidence, overlap, absent = _table(examples)
    if absent.all() or not absent.any():
        raise DataError(
            f"{absent.sum()} absent regions among {len(absent)}: both kinds are needed to tell "
            "them apart; measure more pairs, or objects that lack parts"
        )
    weight = _weights(examples) * np.where(absent, _ABSENT_WEIGHT, 1.0)
    columns = np.column_stack([np.ones(len(evidence)), evidence])

    def loss(rule: np.ndarray) -> float:
        score = columns @ rule
        each = np.logaddexp(0, score) - overlap * score
        return float(weight @ each + _RIDGE * rule[1:] @ rule[1:])

    bias, *weights = minimize(loss, np.zeros(columns.shape[1])).x
    return PresenceRule(float(bias), tuple(float(w) for w in weights))


def cross_validate(examples: Sequence[Example]) -> np.ndarray:
    """The overlap (n,) to be expected of each example, by a rule that was fitted on examples with
    neither its target nor, as a target, its reference (nor others of their series)."""
    series = [(_series(e.reference), _series(e.target)) for e in examples]
    evidence = _table(examples)[0]
    found = np.zeros(len(examples))
    for name in dict.fromkeys(target for _, target in series):
        mine = [i for i, (_, target) in enumerate(series) if target == name]
        rule = fit([e for e, its in zip(examples, series, strict=True) if name not in its])
        found[mine] = rule.overlap(evidence[mine])
    return found


def summary(
    examples: Sequence[Example], overlap: np.ndarray
) -> list[tuple[str, str, str, int, int, int, float, float]]:
    """Rows: source, kind, "there" or "absent", number, how many of them are told absent, how many
    are below the confidence that a transfer skips at, mean expected and mean true overlap."""
    rows = []
    groups = dict.fromkeys((e.source, e.kind) for e in examples)
    for source, kind in sorted(groups):
        for state in (False, True):
            chosen = np.array(
                [(e.source, e.kind, e.absent) == (source, kind, state) for e in examples]
            )
            if chosen.any():
                its, true = overlap[chosen], [e.overlap for e in examples]
                rows.append((
                    source, kind, "absent" if state else "there", int(chosen.sum()),
                    int((its < SURELY_ABSENT).sum()), int((its < MIN_CONFIDENCE).sum()),
                    float(its.mean()), float(np.array(true)[chosen].mean()),
                ))  # fmt: skip
    return rows


def _series(name: str) -> str:
    """ "chair/mammut_1" and "stool/mammut_2" are of one series."""
    return name.rpartition("/")[2].partition("_")[0]


def _weights(examples: Sequence[Example]) -> np.ndarray:
    """(n,) that give each source and kind of scan the same total, 1000 in all."""
    groups = [(e.source, e.kind) for e in examples]
    sizes = {group: groups.count(group) for group in set(groups)}
    return np.array([1000 / len(sizes) / sizes[group] for group in groups])


def _table(examples: Sequence[Example]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Evidence (n, e), overlaps (n,), and which are absent (n,)."""
    evidence = np.array([e.evidence for e in examples], float)
    evidence = evidence.reshape(len(examples), len(Evidence._fields))
    overlap = np.array([e.overlap for e in examples], float)
    return evidence, overlap, np.array([e.absent for e in examples], bool)
