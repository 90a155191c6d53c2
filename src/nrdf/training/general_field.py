"""Training of the general field: on pairs of every kind, minutes to hours on one core."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from nrdf.errors import DataError
from nrdf.field.general import GENERAL, GeneralConfig, GeneralField
from nrdf.field.pair_inverse import Places, Tokens
from nrdf.field.tokens import farthest_points, gather, squared_distances
from nrdf.field.zoo import WEIGHTS
from nrdf.shapes.dataset import read_shape
from nrdf.training.checkpoint import latest_checkpoint, read_position
from nrdf.training.general_pairs import Groups, Side, draw_pairs, make_pool
from nrdf.training.provenance import list_shapes, provenance
from nrdf.training.small_networks import (
    Settings,
    fastest,
    run_steps,
    small_run,
    write_small_network,
)

_SURFACE_POINTS = 2048  # kept of each shape
_EARLY = 0.3  # weight of each look before the last
_PLACE, _ERROR, _MATCH, _EXISTENCE = 4.0, 0.05, 0.12, 0.1
_SPREAD = 0.035  # canonical distance over which tokens count as a match
_NORMAL_WEIGHT = 0.106
_VALIDATION_PAIRS = 64


@dataclass(frozen=True)
class GeneralSettings(Settings):
    """kinds: assemblies drawn at random; families: parametric ones, with that many groups of
    members of each."""

    steps: int = 7000
    batch: int = 16
    rate: float = 1.2e-3
    kinds: int = 1400
    families: tuple[str, ...] = ("chair",)
    family_groups: int = 150


def train_general(
    data: Sequence[Path],
    out: Path,
    settings: GeneralSettings | None = None,
    config: GeneralConfig | None = None,
    overwrite: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Train on the shapes of data folders, on random assemblies and families; killed at any moment,
    the same call goes on.

    Writes checkpoints and metrics.jsonl into `out`, and weights.safetensors at the end, whose path
    it returns. Shapes that are not for training are not looked at. Raises DataError for folders
    without shapes, OutputError for a folder that holds something else.
    """
    settings = settings or GeneralSettings()
    entries = [entry for entry in list_shapes(data) if entry.split == "train"]
    if not entries:
        raise DataError(f"no training shapes in {', '.join(map(str, data)) or 'no folder'}")
    config = config or GeneralConfig()
    names = [entry.path.stem for entry in entries]
    with small_run(GeneralField.preset, config, "", settings, names, out, overwrite):
        pool = make_pool(
            [_surface(entry.path) for entry in entries],
            settings.kinds, settings.families, settings.family_groups, settings.seed,
        )  # fmt: skip
        torch.manual_seed(settings.seed)
        field = GeneralField(config)

        def loss_at(generator: torch.Generator) -> Tensor:
            loss, _ = pair_loss(field, draw_pairs(pool, settings.batch, generator))
            return loss

        run_steps(field, settings, loss_at, out, progress)
        with torch.inference_mode():
            unseen = make_pool([], _VALIDATION_PAIRS // 2, (), 0, settings.seed + 1)
            generator = torch.Generator().manual_seed(settings.seed)
            _, error = pair_loss(field, draw_pairs(unseen, _VALIDATION_PAIRS, generator))
        sources = provenance(entries)
        for source, count in (
            ("assemblies", settings.kinds),
            *((f"family {name}", settings.family_groups) for name in settings.families),
        ):
            sources[source] = {"count": count, "licences": {"MIT": count}}
        scores = {"assemblies": float(error)}
        return write_small_network(out, field, "", settings, sources, scores)


@dataclass(frozen=True)
class FineTuneSettings(Settings):
    """start: name or file of the general model that training begins with. kinds: assemblies drawn
    at random that are shown as well, so that nothing is forgotten."""

    start: str = GENERAL
    steps: int = 300
    batch: int = 16
    rate: float = 4e-4
    kinds: int = 100


def fine_tune_general(
    start: GeneralField,
    shapes: Sequence[Path],
    groups: Callable[[], Groups],
    out: Path,
    category: str,
    settings: FineTuneSettings,
    overwrite: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Train a general field, of `settings.start`, further for one category; killed at any moment,
    the same call goes on.

    shapes: files of its shapes, whose surfaces are deformed; groups: gives the places of their
    points on each other (`nrdf.learn.synchronized`), asked only where training begins or goes on.
    Writes into `out` as `train_general` does and returns the path of weights.safetensors. Raises
    DataError for shapes that cannot be read, OutputError for a folder that holds something else.
    """
    names = [path.stem for path in shapes]
    with small_run(GeneralField.preset, start.config, category, settings, names, out, overwrite):
        checkpoint = latest_checkpoint(out)
        done = checkpoint is not None and read_position(checkpoint).total == settings.steps
        if done and (out / WEIGHTS).exists():
            return out / WEIGHTS
        field = copy.deepcopy(start)
        found = groups()
        surfaces = [_surface(path) for path in shapes]
        pool = make_pool(surfaces, settings.kinds, (), 0, settings.seed, others=found)
        torch.manual_seed(settings.seed)

        def loss_at(generator: torch.Generator) -> Tensor:
            return pair_loss(field, draw_pairs(pool, settings.batch, generator))[0]

        run_steps(field, settings, loss_at, out, progress)
        entries = list_shapes(list(dict.fromkeys(path.parent for path in shapes)))
        return write_small_network(out, field, category, settings, provenance(entries), {})


def pair_loss(field: GeneralField, pair: tuple[Side, Side]) -> tuple[Tensor, Tensor]:
    """The loss of a batch of pairs, both ways, and the mean error of the places that exist."""
    with fastest():
        sides = [_tokens(field, side) for side in pair]
        found = field.inverse(sides[0][0], sides[1][0])
    losses, errors = [], []
    for there, (_, chosen), side, other in zip(
        found, sides, pair, (sides[1][0], sides[0][0]), strict=True
    ):
        loss, error = _loss(there, _select(side, chosen), other)
        losses.append(loss)
        errors.append(error)
    return torch.stack(losses).mean(), torch.stack(errors).mean()


def _tokens(field: GeneralField, side: Side) -> tuple[Tokens, Tensor]:
    """A side's tokens, and which of its points they are (b, t)."""
    count = field.config.tokens
    chosen = farthest_points(side.points, count)
    return field.encoder(side.points, side.normals, chosen), chosen


def _select(side: Side, chosen: Tensor) -> Side:
    points, normals, true_points, true_normals = (gather(values, chosen) for values in side[:4])
    return Side(points, normals, true_points, true_normals, side.exists.gather(1, chosen))


def _loss(found: Places, true: Side, other: Tokens) -> tuple[Tensor, Tensor]:
    exists = true.exists
    total = exists.sum().clamp_min(1)

    def mean(values: Tensor) -> Tensor:
        return (values * exists).sum() / total

    errors = [
        ((look.float() - true.true_points).square().sum(-1) + 1e-6).sqrt() for look in found.looks
    ]
    place = mean(errors[-1]) + _EARLY * sum(mean(error) for error in errors[:-1])
    logarithm = found.log_error.clamp(-6, 1)
    doubt = mean(errors[-1].detach() * (-logarithm).exp() + logarithm)
    with torch.no_grad():
        weight = _NORMAL_WEIGHT
        far = squared_distances(
            torch.cat([true.true_points, weight * true.true_normals], -1),
            torch.cat([other.points, weight * other.normals], -1),
        )
        matches = (-far / (2 * _SPREAD**2)).softmax(-1)
    match = -mean((matches * found.matches).sum(-1))
    existence = functional.binary_cross_entropy_with_logits(found.existence, exists)
    loss = _PLACE * place + _ERROR * doubt + _MATCH * match + _EXISTENCE * existence
    return loss, mean(errors[-1].detach())


def _surface(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Points and normals (`_SURFACE_POINTS`, 3) of a training shape."""
    shape = read_shape(path)
    rng = np.random.default_rng(0)
    chosen = rng.choice(len(shape.surface_points), _SURFACE_POINTS, replace=False)
    return shape.surface_points[chosen], shape.surface_normals[chosen]
