"""How absence is told from evidence: the logistic regression behind `nrdf.regions.presence`.

Fitted on pairs of family members that neither the benchmark of scans nor training has, whole and
in simulated scans, where it is known which regions a target lacks.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import TypeAdapter, ValidationError
from scipy.optimize import minimize

from nrdf.benchmark.scans import KINDS, RegionFigure, score_regions
from nrdf.errors import DataError
from nrdf.files import read_file
from nrdf.locks import writing
from nrdf.ply import write_atomically
from nrdf.regions.presence import ABSENT
from nrdf.scans.judge import Judge
from nrdf.shapes.families import get_family

_ROWS = TypeAdapter(list[RegionFigure])
_LARGEST = 1 << 26

FIRST_SEED = 1_000_000
"""Of the members that are fitted on."""
_CHOICE = 5
_FOLDS = 5
_RIDGE = 1e-2  # keeps the regression finite where the evidence separates all


@dataclass(frozen=True)
class Rule:
    """Absent where bias + weights @ evidence > 0."""

    bias: float
    weights: tuple[float, ...]

    def absent(self, evidence: np.ndarray) -> np.ndarray:
        """(n,) bool for evidence (n, e)."""
        return self.bias + evidence @ np.array(self.weights) > 0


def collect(
    judge: Callable[[], Judge],
    category: str,
    pairs: int,
    folder: Path,
    progress: Callable[[int, int], None],
) -> list[RegionFigure]:
    """Every region of `pairs` pairs of members, in every kind of scan (`choose_pairs`).

    Each pair is kept in a file of `folder`, and not measured again. Raises OutputError if it cannot
    be written, DataError for a file that is damaged.
    """
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    figures: list[RegionFigure] = []
    ready: Judge | None = None
    for done, pair in enumerate(choose_pairs(category, pairs), 1):
        path = folder / f"{category}-{pair:03d}.json"
        if not path.is_file():
            ready = ready or judge()
            found = [vars(f) for f in score_regions(ready, category, pair, FIRST_SEED)]
            write_atomically(path, [json.dumps(found).encode()])
        figures += _read(path)
        progress(done, pairs)
    return figures


def choose_pairs(category: str, count: int) -> list[int]:
    """Numbers of pairs to measure: of five times as many, those first whose target lacks most of
    the regions that its reference has."""
    family = get_family(category)
    lacks = []
    for pair in range(_CHOICE * count):
        taught, target = (
            {*family.region_of(surface.coordinates)}
            for surface in (
                family.member(FIRST_SEED + 2 * pair + i).sample_surface(1024, rng)
                for i, rng in enumerate(map(np.random.default_rng, (0, 1)))
            )
        )
        lacks.append(len(taught - target - {""}))
    return sorted(np.argsort(-np.array(lacks), kind="stable")[:count].tolist())


def fit(figures: Sequence[RegionFigure]) -> Rule:
    """The rule that tells absent regions from those that are there and seen, or hidden.

    Raises DataError where there are none of either.
    """
    evidence, absent = _table(figures)
    if absent.all() or not absent.any():
        raise DataError(
            f"{absent.sum()} absent regions among {len(absent)}: both kinds are needed to tell "
            "them apart; measure more pairs, or a category whose members lack parts"
        )
    sign = np.where(absent, 1.0, -1.0)
    columns = np.column_stack([np.ones(len(evidence)), evidence])

    def loss(rule: np.ndarray) -> float:
        return float(np.logaddexp(0, -sign * (columns @ rule)).sum() + _RIDGE * rule @ rule)

    bias, *weights = minimize(loss, np.zeros(columns.shape[1])).x
    return Rule(float(bias), tuple(float(w) for w in weights))


def cross_validate(figures: Sequence[RegionFigure]) -> list[tuple[str, str, int, int, int]]:
    """Rows: kind, what, how many are told absent by the rule in use, how many by rules that were
    fitted on other pairs, of how many.

    Counted are regions that are absent, and regions that are there.
    """
    refitted = np.zeros(len(figures), bool)
    fold = np.array([figure.pair % _FOLDS for figure in figures])
    for number in np.unique(fold):
        rule = fit([f for f, its in zip(figures, fold.tolist(), strict=True) if its != number])
        mine = np.flatnonzero(fold == number).tolist()
        refitted[mine] = rule.absent(np.array([figures[i].evidence for i in mine]))
    in_use = np.array([figure.reason == ABSENT for figure in figures])
    rows = []
    for kind in KINDS:
        for state in ("absent", "there"):
            chosen = np.array([f.kind == kind and f.state == state for f in figures])
            told = int(in_use[chosen].sum()), int(refitted[chosen].sum())
            rows.append((kind, state, told[0], told[1], int(chosen.sum())))
    return rows


def _table(figures: Sequence[RegionFigure]) -> tuple[np.ndarray, np.ndarray]:
    """Evidence (n, e) of regions in scans, and which are absent, (n,)."""
    chosen = [f for f in figures if f.kind in KINDS]
    evidence = np.array([f.evidence for f in chosen], float).reshape(len(chosen), -1)
    return evidence, np.array([f.state == "absent" for f in chosen], bool)


def _read(path: Path) -> list[RegionFigure]:
    try:
        return _ROWS.validate_json(read_file(path, DataError, _LARGEST))
    except ValidationError as error:
        fault = error.errors(include_url=False)[0]["msg"]
        raise DataError(f"{path} is damaged ({fault}); delete it and start again") from None
