"""Table III: the field trained without each loss of its last stage, and with all of them.

The stages before the last are the same in every variant, so they are trained once: `shared/` in the
output folder is a run that every variant begins from (`nrdf.training.loop.train`).
"""

from __future__ import annotations

import csv
import io
import json
import logging
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

from nrdf.benchmark.bsrc import BenchmarkObject
from nrdf.benchmark.evaluate import MISSED
from nrdf.benchmark.family import CLOUD_POINTS, FIRST_SEED
from nrdf.benchmark.methods import Method
from nrdf.benchmark.metrics import chamfer_l1
from nrdf.cloud import PointCloud
from nrdf.errors import ConfigError, DataError, OutputError, unknown_name
from nrdf.field.base import Field
from nrdf.field.zoo import WEIGHTS
from nrdf.output import write_json
from nrdf.ply import write_atomically
from nrdf.shapes.families import get_family
from nrdf.training.checkpoint import IDENTITY, open_run
from nrdf.training.config import TrainConfig
from nrdf.training.data import Bank, seeded
from nrdf.training.loop import run_identity, train
from nrdf.training.losses import LOSSES, Forward
from nrdf.training.provenance import list_shapes

log = logging.getLogger(__name__)

COMPLETE, SHARED = "complete", "shared"
OMITTED = {
    "cd": "chamfer",
    "emd": "emd",
    "ncd": "normal_consistency",
    "ds": "smoothness",
    "dd": "descriptor_distance",
}
"""Variant to the loss that it is trained without, by the paper's abbreviations."""
VARIANTS = (COMPLETE, *OMITTED)
SCHEDULES = {"short": "paper-short", "full": "paper"}
"""Schedule to the configuration that it trains."""
COST = "cost.json"
LEAST_POINTS = 64
"""A region of a family pair counts if both members have as many points of it."""
VALIDATION_STEPS, VALIDATION_BATCH, VALIDATION_POINTS = 8, 8, 512


def variant_config(config: TrainConfig, variant: str) -> TrainConfig:
    """The configuration with one loss fewer in its last stage, or as it is ("complete").

    Raises ConfigError for an unknown variant, and one whose loss the last stage does not have.
    """
    if variant not in VARIANTS:
        raise ConfigError(unknown_name("variant", variant, VARIANTS))
    if variant == COMPLETE:
        return config
    stage, loss = config.stages[-1], OMITTED[variant]
    if loss not in stage.weights:
        raise ConfigError(
            f"variant '{variant}' leaves out '{loss}', which the last stage '{stage.name}' does "
            f"not have: {', '.join(stage.weights)}"
        )
    weights = {name: weight for name, weight in stage.weights.items() if name != loss}
    stages = [*config.stages[:-1], stage.model_copy(update={"weights": weights})]
    return config.model_copy(update={"stages": stages})


def shared_config(config: TrainConfig) -> TrainConfig:
    """The stages before the last. Raises ConfigError where there are none."""
    if len(config.stages) < 2:
        raise ConfigError("an ablation needs stages before the one that loses a loss; add one")
    return config.model_copy(update={"stages": config.stages[:-1]})


def train_variants(
    variants: Sequence[str],
    config: TrainConfig,
    data: Sequence[Path],
    out: Path,
    *,
    category: str,
    device: str = "auto",
    overwrite: bool = False,
) -> dict[str, Path]:
    """Train what of the variants is not trained yet, each in a folder of `out`; their folders.

    Started again after whatever ended it, it goes on. Other processes may train other variants in
    the same `out` meanwhile; one that wants the same run waits until it is done. Errors are those
    of `variant_config` and `nrdf.training.loop.train`.
    """
    if int(os.environ.get("WORLD_SIZE", "1")) > 1:
        raise ConfigError(
            "an ablation does not run under torchrun; start one command for each device, each "
            "with some of the variants"
        )
    settings = {name: variant_config(config, name) for name in variants}
    shapes = [entry.path.stem for entry in list_shapes(data) if entry.split == "train"]

    def run(name: str, wanted: TrainConfig, begin: Path | None, what: str) -> None:
        folder = out / name
        with _alone(out, name):
            identity = run_identity(wanted, category, shapes)
            if open_run(folder, identity, overwrite) and (folder / WEIGHTS).is_file():
                log.info("%s: trained already", what)
                return
            log.info("%s: training", what)
            with _timed(folder):
                train(wanted, data, folder, category=category, device=device, begin=begin)

    run(SHARED, shared_config(config), None, "stages that all variants share")
    for number, (name, wanted) in enumerate(settings.items(), 1):
        run(name, wanted, out / SHARED, f"{describe(name)} ({number} of {len(settings)})")
    return {name: out / name for name in variants}


def describe(variant: str) -> str:
    """A variant in words: "all losses" or "without CD"."""
    return "all losses" if variant == COMPLETE else f"without {variant.upper()}"


def read_cost(run: Path) -> float:
    """Seconds that a run of `train_variants` has taken so far, over all its interruptions."""
    try:
        return float(json.loads((run / COST).read_text(encoding="utf-8"))["seconds"])
    except (OSError, ValueError, KeyError, TypeError):
        return 0.0


@contextmanager
def _timed(run: Path) -> Iterator[None]:
    before, start = read_cost(run), time.perf_counter()
    try:
        yield
    finally:
        if (run / IDENTITY).is_file():
            seconds = before + time.perf_counter() - start
            write_json(run / COST, {"seconds": round(seconds, 1)})


@contextmanager
def _alone(out: Path, name: str) -> Iterator[None]:
    """Other processes that want the same run wait meanwhile (not on Windows)."""
    try:
        import fcntl
    except ImportError:
        yield
        return
    try:
        out.mkdir(parents=True, exist_ok=True)
        handle = os.open(out / f".{name}.lock", os.O_CREAT | os.O_RDWR)
    except OSError as error:
        raise OutputError(
            f"cannot write to {out}: {error.strerror}; choose another --out"
        ) from None
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            log.info("waiting for %s, which another process trains", out / name)
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


def family_pairs(category: str, count: int) -> list[tuple[BenchmarkObject, BenchmarkObject]]:
    """Pairs of members that no training set holds, with the family's named regions that both have.

    Raises DataError for a category without a family, or no pairs.
    """
    if count < 1:
        raise DataError(f"{count} pairs asked for; give at least 1")
    family = get_family(category)
    pairs = []
    for number in range(count):
        seeds = (FIRST_SEED + 2 * number, FIRST_SEED + 2 * number + 1)
        rng = np.random.default_rng(FIRST_SEED + number)
        surfaces = [family.member(seed).sample_surface(CLOUD_POINTS, rng) for seed in seeds]
        named = [family.region_of(surface.coordinates) for surface in surfaces]
        common = [
            name
            for name in family.region_names
            if all((names == name).sum() >= LEAST_POINTS for names in named)
        ]
        reference, target = (
            BenchmarkObject(
                f"{category}-{seed}",
                PointCloud(surface.points, surface.normals),
                {name: surface.points[names == name] for name in common},
            )
            for seed, surface, names in zip(seeds, surfaces, named, strict=True)
        )
        pairs.append((reference, target))
    return pairs


def score(
    method: Method,
    pairs: Sequence[tuple[BenchmarkObject, BenchmarkObject]],
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, float]:
    """Mean CD-L1 (the paper's convention) of every region over the pairs that have it.

    A region that is found nowhere counts as `MISSED`. `progress` is told (done, all).
    """
    distances: dict[str, list[float]] = {}
    for number, (reference, target) in enumerate(pairs):
        for name, indices in method(reference, target).items():
            distance = MISSED
            if len(indices):
                distance = chamfer_l1(target.cloud.points[indices], target.regions[name])
            distances.setdefault(name, []).append(distance)
        if progress is not None:
            progress(number + 1, len(pairs))
    return {name: float(np.mean(found)) for name, found in distances.items()}


@torch.no_grad()
def validation_losses(field: Field, bank: Bank) -> dict[str, float]:
    """The omitted losses by their variants' names, on undeformed shapes of a bank, the same draw
    every time: whether a variant still does well at what it was not trained for.

    The clouds have 512 points. Empty where no two shapes can be paired.
    """
    sums = dict.fromkeys(OMITTED, 0.0)
    pools = bank.plain().values()
    for pool in pools:
        size = min(VALIDATION_BATCH, *(len(members) for _, _, members in pool.pools))
        for step in range(VALIDATION_STEPS):
            batch = pool.batch(size, seed=0, step=step)
            forward = Forward(field, batch, seeded(bank.device, step), VALIDATION_POINTS)
            for variant, loss in OMITTED.items():
                sums[variant] += float(LOSSES[loss](forward))
    return {name: value / (VALIDATION_STEPS * len(pools)) for name, value in sums.items() if pools}


@dataclass(frozen=True)
class VariantResult:
    """One row of Table III.

    regions: name to mean CD-L1; validation: variant to the loss that it omits, on unseen shapes;
    seconds: of training, without the shared stages; training: what the weight file says of it.
    """

    variant: str
    regions: dict[str, float]
    validation: dict[str, float]
    seconds: float
    training: dict[str, Any]

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
        """Markdown: a row a variant; beside its score the value of every omitted loss on unseen
        shapes, and the published score where it is known."""
        published = PUBLISHED.get(self.category, {})
        losses = list(self.results[0].validation) if self.results else []
        columns = [f"{self.category}, {self.schedule} schedule", "**CD-L1**"]
        columns += ["published"] * bool(published) + [name.upper() for name in losses]
        lines = [f"| {' | '.join([*columns, 'training, s'])} |", "|---" * (len(columns) + 1) + "|"]
        for row in self.results:
            cells = [describe(row.variant), f"**{row.mean:.4f}**"]
            if published:
                cells.append(f"{published[row.variant]:.3f}" if row.variant in published else "")
            cells += [f"{row.validation[name]:.4f}" for name in losses]
            lines.append(f"| {' | '.join([*cells, f'{row.seconds:.0f}'])} |")
        lines += ["", f"CD-L1: {CONVENTION}, by eq. 9, on {self.ground}; lower is better."]
        if losses:
            lines.append("The other columns: the losses themselves, on shapes not trained on.")
        lines.append(
            f"Stages that all share: {self.shared_seconds:.0f} s, not counted in the rows."
        )
        return "\n".join(lines)

    def csv(self) -> str:
        """A line a variant: score, regions, losses on unseen shapes, seconds."""
        first = self.results[0]
        regions, losses = list(first.regions), list(first.validation)
        rows: list[list[object]] = [
            ["variant", "cd_l1", *regions, *(f"validation_{name}" for name in losses), "seconds"]
        ]
        for row in self.results:
            values = [row.mean, *map(row.regions.get, regions), *map(row.validation.get, losses)]
            rows.append([row.variant, *(f"{value:.6f}" for value in values), f"{row.seconds:.1f}"])
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
            "convention": CONVENTION,
            "ground": self.ground,
            "published": PUBLISHED.get(self.category, {}),
            "shared_seconds": self.shared_seconds,
            "variants": [{"mean": row.mean, **asdict(row)} for row in self.results],
        }
        text = json.dumps(content, indent=1, ensure_ascii=False)
        for suffix, part in (("md", self.table() + "\n"), ("csv", self.csv()), ("json", text)):
            write_atomically(folder / f"table3.{suffix}", [part.encode("utf-8")])


PUBLISHED: dict[str, dict[str, float]] = {}
"""Category to variant to the paper's mean CD-L1. Empty: this project does not know the figures of
the paper's Table III; where they are entered, the table has a column of them."""
CONVENTION = "Manhattan nearest-neighbour distance, mean, summed over both directions"
