"""Table III's scores: of trained variants, on BSRC or on the parametric families."""

from __future__ import annotations

import csv
import hashlib
import io
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch

from nrdf.errors import DataError
from nrdf.field.base import Field
from nrdf.field.zoo import WEIGHTS
from nrdf.io.atomic import write_atomically
from nrdf.io.cloud import PointCloud
from nrdf.shapes.families import get_family
from nrdf.tasks import Workers
from nrdf.training.batch import seeded
from nrdf.training.dataset import ShapeDataset
from nrdf.training.losses import LOSSES, LossContext
from nrdf_benchmark.ablation.training import COMPLETE, OMITTED, describe
from nrdf_benchmark.bsrc.dataset import Benchmark
from nrdf_benchmark.bsrc.evaluate import evaluate
from nrdf_benchmark.families import CLOUD_POINTS, FIRST_SEED
from nrdf_benchmark.methods.registry import Method, MethodSpec
from nrdf_benchmark.metrics import METRICS, MISSED, chamfer_l1
from nrdf_benchmark.result_cache import PairCache

PUBLISHED = {
    "chair": {"complete": 0.039, "cd": 0.048, "emd": 0.223, "ncd": 0.049, "ds": 0.047, "dd": 0.042},
    "car": {"complete": 0.019, "cd": 0.023, "emd": 0.275, "ncd": 0.024, "ds": 0.022, "dd": 0.020},
    "plane": {"complete": 0.035, "cd": 0.047, "emd": 0.351, "ncd": 0.037, "ds": 0.037, "dd": 0.038},
}
"""Category to variant to the mean CD-L1 of the paper's Table III, all 90 pairs of BSRC."""
BY_POINTS = "nrdf-paper"
"""Method that associates by the paper's eq. 9."""
LEAST_POINTS = 64
"""A region of a family pair counts if both members have as many points of it."""
VALIDATION_STEPS, VALIDATION_BATCH, VALIDATION_POINTS = 8, 8, 512


class Case(NamedTuple):
    """A pair that is scored: regions of a reference, and the true ones on a target, as points."""

    reference: PointCloud
    regions: dict[str, np.ndarray]
    target: PointCloud
    truth: dict[str, np.ndarray]


def benchmark_scores(
    benchmark: Benchmark,
    run: Path,
    device: str = "cpu",
    workers: Workers = 1,
    progress: Callable[[str, int, int], None] | None = None,
) -> dict[str, float]:
    """Mean CD-L1 of every region over BSRC's ordered pairs, by eq. 9, of a trained run.

    Pairs that are done are kept in the run's folder (`PairCache`). `progress` and errors are
    those of `nrdf_benchmark.bsrc.evaluate.evaluate`.
    """
    weights = run / WEIGHTS
    checksum = hashlib.sha256(weights.read_bytes()).hexdigest()
    spec = MethodSpec(BY_POINTS, weights.resolve(), checksum, device)
    result = evaluate(benchmark, [spec], workers, PairCache(run), progress)[0]
    return {roi: float(mean) for roi, mean in zip(result.rois, result.by_roi("cd-l1"), strict=True)}


def family_cases(category: str, count: int) -> list[Case]:
    """Pairs of members that no training set holds, with the family's named regions that both have.

    Raises DataError for a category without a family, or no pairs.
    """
    if count < 1:
        raise DataError(f"{count} pairs asked for; give at least 1")
    family = get_family(category)
    cases = []
    for number in range(count):
        rng = np.random.default_rng(FIRST_SEED + number)
        clouds, named = [], []
        for seed in (FIRST_SEED + 2 * number, FIRST_SEED + 2 * number + 1):
            surface = family.member(seed).sample_surface(CLOUD_POINTS, rng)
            clouds.append(PointCloud(surface.points, surface.normals))
            named.append(family.region_of(surface.coordinates))
        reference, target = (
            {
                name: cloud.points[names == name]
                for name in family.region_names
                if all((other == name).sum() >= LEAST_POINTS for other in named)
            }
            for cloud, names in zip(clouds, named, strict=True)
        )
        cases.append(Case(clouds[0], reference, clouds[1], target))
    return cases


def score(
    match: Method, cases: Sequence[Case], progress: Callable[[int, int], None] | None = None
) -> dict[str, float]:
    """Mean CD-L1 (the paper's convention) of every region over the cases that have it.

    A region that is found nowhere counts as `MISSED`. `progress` is told (done, all).
    """
    distances: dict[str, list[float]] = {}
    for number, case in enumerate(cases, 1):
        for name, indices in match(case.reference, case.regions, case.target).items():
            distance = MISSED
            if len(indices):
                distance = chamfer_l1(case.target.points[indices], case.truth[name])
            distances.setdefault(name, []).append(distance)
        if progress is not None:
            progress(number, len(cases))
    return {name: float(np.mean(found)) for name, found in distances.items()}


@torch.no_grad()
def validation_losses(field: Field, dataset: ShapeDataset) -> dict[str, float]:
    """The omitted losses by their variants' names, on undeformed shapes, the same draw every
    time: whether a variant still does well at what it was not trained for.

    The clouds have 512 points. Empty where no two shapes can be paired.
    """
    sums = dict.fromkeys(OMITTED, 0.0)
    pools = dataset.plain().values()
    for pool in pools:
        size = min(VALIDATION_BATCH, *(len(of.members) for of in pool.pools))
        for step in range(VALIDATION_STEPS):
            batch = pool.batch(size, seed=0, step=step)
            context = LossContext(field, batch, seeded(dataset.device, step), VALIDATION_POINTS)
            for variant, loss in OMITTED.items():
                sums[variant] += float(LOSSES[loss](context))
    return {name: value / (VALIDATION_STEPS * len(pools)) for name, value in sums.items() if pools}


@dataclass(frozen=True)
class VariantResult:
    """One training of Table III.

    regions: name to mean CD-L1; validation: variant to the loss that it omits, on unseen shapes;
    seconds: of training, without the shared stages; training: what the weight file says of it;
    seed: of the last stage.
    """

    variant: str
    regions: dict[str, float]
    validation: dict[str, float]
    seconds: float
    training: dict[str, Any]
    seed: int = 0

    @property
    def mean(self) -> float:
        """Mean CD-L1 over the regions."""
        return float(np.mean(list(self.regions.values())))


@dataclass(frozen=True)
class Ablation:
    """Table III of one category. ground: what CD-L1 was measured on, in words; shared_seconds: of
    training the stages that all variants share."""

    category: str
    schedule: str
    ground: str
    shared_seconds: float
    results: list[VariantResult]

    def table(self) -> str:
        """Markdown: a row a variant, the mean and the range over its seeds, and the range of what
        it is above all losses with the same seed; beside them the value of every omitted loss on
        unseen shapes, and the published score where it is known."""
        published = PUBLISHED.get(self.category, {})
        losses = list(self.results[0].validation) if self.results else []
        rows: dict[str, list[VariantResult]] = {}
        for result in self.results:
            rows.setdefault(result.variant, []).append(result)
        ranges: list[str] = []
        if any(len(row) > 1 for row in rows.values()):
            ranges = ["lowest to highest", "above all losses, by seed"]
        complete = {result.seed: result.mean for result in rows.get(COMPLETE, [])}
        columns = [f"{self.category}, {self.schedule} schedule", "**CD-L1**", *ranges]
        columns += ["published"] * bool(published) + [f"{name.upper()} loss" for name in losses]
        lines = [f"| {' | '.join([*columns, 'training, s'])} |", "|---" * (len(columns) + 1) + "|"]
        for variant, row in rows.items():
            means = [result.mean for result in row]
            cells = [describe(variant), f"**{np.mean(means):.4f}**"]
            if ranges:
                above = [r.mean - complete[r.seed] for r in row if r.seed in complete]
                cells.append(f"{min(means):.4f} to {max(means):.4f}" if len(row) > 1 else "")
                shown = len(above) > 1 and variant != COMPLETE
                cells.append(f"{min(above):+.4f} to {max(above):+.4f}" if shown else "")
            if published:
                cells.append(f"{published[variant]:.3f}" if variant in published else "")
            cells += [f"{np.mean([r.validation[name] for r in row]):.4f}" for name in losses]
            lines.append(f"| {' | '.join(cells)} | {np.mean([r.seconds for r in row]):.0f} |")
        lines += [
            "",
            f"CD-L1 by eq. 9, on {self.ground}: {METRICS['cd-l1'].formula}. Lower is better.",
        ]
        if ranges:
            count = max(len(row) for row in rows.values())
            lines.append(f"Means of {count} seeds of the last stage, from the same shared stages.")
        if losses:
            lines.append("The losses themselves are of shapes not trained on.")
        lines.append(
            f"Stages that all share: {self.shared_seconds:.0f} s, not counted in the rows."
        )
        return "\n".join(lines)

    def csv(self) -> str:
        """A line a training: variant, seed, score, regions, losses on unseen shapes, seconds."""
        first = self.results[0]
        regions, losses = list(first.regions), list(first.validation)
        names = [*regions, *(f"validation_{name}" for name in losses), "seconds"]
        rows: list[list[object]] = [["variant", "seed", "cd_l1", *names]]
        for row in self.results:
            values = [row.mean, *map(row.regions.get, regions), *map(row.validation.get, losses)]
            numbers = (f"{value:.6f}" for value in values)
            rows.append([row.variant, row.seed, *numbers, f"{row.seconds:.1f}"])
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerows(rows)
        return text.getvalue()

    def write(self, folder: Path, extra: Mapping[str, Any]) -> None:
        """Write `table3.md`, `table3.csv` and `table3.json` into `folder`, which exists; `extra`
        goes into the last. Raises OutputError where they cannot be written."""
        content = {
            **extra,
            "category": self.category,
            "schedule": self.schedule,
            "convention": METRICS["cd-l1"].formula,
            "ground": self.ground,
            "published": PUBLISHED.get(self.category, {}),
            "shared_seconds": self.shared_seconds,
            "variants": [{"mean": row.mean, **asdict(row)} for row in self.results],
        }
        text = json.dumps(content, indent=1, ensure_ascii=False)
        for suffix, part in (("md", self.table() + "\n"), ("csv", self.csv()), ("json", text)):
            write_atomically(folder / f"table3.{suffix}", [part.encode("utf-8")])
