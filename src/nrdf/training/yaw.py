"""Training of the networks that tell yaw: on simulated views of training shapes.

Which points of a shape a camera sees is worked out once for a ring of cameras, and kept as a bit a
camera; a step draws cameras, a yaw, noise, and what else befalls a scan.
"""

from __future__ import annotations

import json
import logging
import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime, timezone
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from nrdf.errors import DataError
from nrdf.field.weights import save_weights
from nrdf.field.yaw import YawConfig, YawNetwork, turn
from nrdf.field.zoo import WEIGHTS
from nrdf.geometry import seen_from
from nrdf.locks import claim, writing
from nrdf.shapes.dataset import read_shape
from nrdf.training.checkpoint import (
    METRICS,
    Position,
    latest_checkpoint,
    load_field_state,
    load_optimizer_state,
    open_run,
    read_position,
    save_checkpoint,
    write_identity,
)
from nrdf.training.distributed import Workers
from nrdf.training.provenance import Entry, environment, list_shapes, provenance

log = logging.getLogger(__name__)

CHECKPOINT_EVERY = 200
_AROUND, _ELEVATIONS = 16, np.radians([12.0, 25.0, 40.0])
CAMERAS = np.array(
    [
        [np.cos(e) * np.cos(a), np.sin(e), np.cos(e) * np.sin(a)]
        for a in 2 * np.pi / _AROUND * np.arange(_AROUND)
        for e in _ELEVATIONS
    ]
)
"""(48, 3) directions that cameras look from, three elevations at each azimuth."""
_VIEWS = torch.tensor([0, 1, 1, 1, 2, 3, 3, 4])  # drawn alike; 0 is the whole surface
_HELD_OUT = 10  # one in so many shapes of each source tells how well others are done
_SPREAD = 1.0  # of the yaws that count as right, in bins


@dataclass(frozen=True)
class YawSettings:
    """steps of `batch` clouds; rate: the highest of a cosine; noise, canonical, of points; seed."""

    steps: int = 1000
    batch: int = 48
    rate: float = 2e-3
    noise: float = 0.004
    seed: int = 0


@dataclass(frozen=True)
class Views:
    """points, normals: (s, n, 3) of shapes; bits: (s, n) int64, bit i where camera i sees it."""

    points: Tensor
    normals: Tensor
    bits: Tensor

    def __len__(self) -> int:
        return len(self.points)


def train_yaw(
    category: str,
    data: Sequence[Path],
    out: Path,
    settings: YawSettings | None = None,
    overwrite: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Train on the shapes of the data folders; killed at any moment, the same call goes on.

    Writes checkpoints and metrics.jsonl into `out`, and weights.safetensors at the end, whose path
    it returns. Validation shapes, and one shape in ten, are not trained on. Raises DataError for
    folders without usable shapes, OutputError for a folder that holds something else.
    """
    settings = settings or YawSettings()
    kept, held = split(list_shapes(data))
    if not kept or not held:
        raise DataError(
            f"{len(kept)} training shapes and {len(held)} to validate with in "
            f"{', '.join(map(str, data))}; at least 10 shapes are needed"
        )
    config = YawConfig()
    identity = {
        "yaw": asdict(settings),
        "network": config.model_dump(mode="json"),
        "category": category,
        "shapes": [entry.path.stem for entry in kept],
    }
    with claim(out):
        resumed = open_run(out, identity, overwrite)
        workers = Workers(0, 1, torch.device("cpu"))
        if not resumed:
            write_identity(out, identity, environment(workers))
        views, validation = load_views(kept, category), load_views(held, category)
        network = _run(settings, config, views, out, progress)
        scores = validate(network, validation, settings)
        path = out / WEIGHTS
        metadata = {
            "category": category,
            "train": asdict(settings),
            "shapes": provenance(kept),
            "scores": scores,
            "date": datetime.now(timezone.utc).isoformat(timespec="seconds"),
            **environment(workers),
        }
        save_weights(path, network, metadata)
        return path


def split(entries: Sequence[Entry]) -> tuple[list[Entry], list[Entry]]:
    """Shapes to train on, and to validate with: every tenth of a source and those of the `val`
    split. The `test` split is in neither."""
    count: dict[str, int] = {}
    kept: list[Entry] = []
    held: list[Entry] = []
    for entry in entries:
        if entry.split == "test":
            continue
        count[entry.source] = count.get(entry.source, 0) + 1
        last = count[entry.source] % _HELD_OUT == 0
        (held if last or entry.split == "val" else kept).append(entry)
    return kept, held


def load_views(entries: Sequence[Entry], category: str, count: int = 4096) -> Views:
    """Shapes as their cameras see them. Raises DataError for a shape of another category."""
    found: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    power = 1 << np.arange(len(CAMERAS), dtype=np.int64)
    for entry in entries:
        shape = read_shape(entry.path)
        if shape.category != category:
            raise DataError(f"{entry.path} is of the category '{shape.category}', not '{category}'")
        rng = np.random.default_rng(0)
        drawn = rng.choice(len(shape.surface_points), count, len(shape.surface_points) < count)
        points, normals = shape.surface_points[drawn], shape.surface_normals[drawn]
        seen = seen_from(points, normals, CAMERAS, steepest=math.sin(math.radians(12)))
        found.append((points, normals, power @ seen.astype(np.int64)))
    points, normals, bits = (np.stack(part) for part in zip(*found, strict=True))
    return Views(
        torch.as_tensor(points, dtype=torch.float32),
        torch.as_tensor(normals, dtype=torch.float32),
        torch.as_tensor(bits),
    )


def draw(
    views: Views, chosen: Tensor, count: int, noise: float, generator: torch.Generator
) -> tuple[Tensor, Tensor, Tensor]:
    """Clouds (b, count, 3) of the shapes `chosen` (b,), their normals, and their yaws (b,) (rad).

    Shapes are stretched by up to a fifth and mirrored; seen by up to four cameras, or whole; the
    lowest of what is seen may go with the floor, and an end of it may be missing.
    """
    b = len(chosen)

    def uniform(*shape: int) -> Tensor:
        return torch.rand(shape, generator=generator)

    points, normals = views.points[chosen], views.normals[chosen]
    seen = _seen(views.bits[chosen], generator)
    stretch = torch.exp(0.2 * (2 * uniform(b, 1, 3) - 1))
    stretch[..., 2] *= torch.where(uniform(b, 1) < 0.5, -1.0, 1.0)
    points, normals = points * stretch, normals / stretch
    # The floor takes the lowest with it, and now and then an end is missing.
    height = points[..., 1] - points[..., 1].amin(1, keepdim=True)
    slab = 0.03 * uniform(b, 1) * (uniform(b, 1) < 0.7)
    away = functional.normalize(torch.randn(b, 1, 3, generator=generator), dim=-1)
    along = (points * away).sum(-1)
    limit = along.masked_fill(~seen, math.nan).nanquantile(0.75, dim=1, keepdim=True)
    whole = (along < limit) | (uniform(b, 1) < 0.85)
    kept = seen & (height > slab) & whole
    kept |= ~kept.any(1, keepdim=True)
    index = torch.multinomial(kept.float() + 1e-9 * ~kept, count, True, generator=generator)
    rows = torch.arange(b)[:, None]
    points, normals = points[rows, index], normals[rows, index]
    yaw = 2 * math.pi * uniform(b)
    rotation = turn(yaw)
    points = points + noise * torch.randn(points.shape, generator=generator)
    normals = normals + 0.1 * torch.randn(normals.shape, generator=generator)
    # Estimated normals are wrong here and there: of some clouds a part points inwards.
    inward = (uniform(b, count) < 0.15 * uniform(b, 1)) & (uniform(b, 1) < 0.3)
    normals = functional.normalize(normals, dim=-1) * torch.where(inward, -1.0, 1.0)[..., None]
    return (
        torch.einsum("bij,bnj->bni", rotation, points),
        torch.einsum("bij,bnj->bni", rotation, normals),
        yaw,
    )


def _seen(bits: Tensor, generator: torch.Generator) -> Tensor:
    """(b, n) bool: what up to four cameras around each shape see of it."""
    b = len(bits)
    count = _VIEWS[torch.randint(len(_VIEWS), (b, 1), generator=generator)]
    first = torch.randint(_AROUND, (b, 1), generator=generator)
    number = torch.arange(int(_VIEWS.max()))
    apart = (number * _AROUND / count.clamp(min=1)).round().long()
    apart += torch.randint(-1, 2, (b, len(number)), generator=generator)
    height = torch.randint(len(_ELEVATIONS), (b, len(number)), generator=generator)
    camera = (first + apart) % _AROUND * len(_ELEVATIONS) + height
    masks = torch.bitwise_left_shift(torch.ones((), dtype=torch.int64), camera)
    masks = masks * (number < count)
    return (bits[..., None] & masks[:, None]).ne(0).any(-1) | (count == 0)


def loss_of(logits: Tensor, yaw: Tensor) -> Tensor:
    """Cross entropy of logits (b, bins) to yaws (b,), bins beside the right one being nearly so."""
    bins = logits.shape[1]
    place = yaw[:, None] / (2 * math.pi) * bins
    apart = (torch.arange(bins) - place + bins / 2) % bins - bins / 2
    wanted = (-0.5 * (apart / _SPREAD) ** 2).softmax(1)
    return functional.cross_entropy(logits, wanted)


def validate(network: YawNetwork, views: Views, settings: YawSettings) -> dict[str, float]:
    """Share of clouds whose yaw is more than 30° off, as shown once; lower is better."""
    network.eval()
    generator = torch.Generator().manual_seed(12345)
    wrong = []
    with torch.inference_mode():
        for chosen in torch.arange(len(views)).repeat(4).split(settings.batch):
            points, normals, yaw = draw(
                views, chosen, network.config.points, settings.noise, generator
            )
            found = network(points, normals).argmax(1) * (2 * math.pi / network.config.bins)
            wrong.append((found - yaw).cos() < math.cos(math.radians(30)))
    return {"wrong-yaws": float(torch.cat(wrong).float().mean())}


def _run(
    settings: YawSettings,
    config: YawConfig,
    views: Views,
    out: Path,
    progress: Callable[[int, int], None] | None,
) -> YawNetwork:
    torch.manual_seed(settings.seed)
    network = YawNetwork(config)
    optimizer = torch.optim.AdamW(network.parameters(), settings.rate, weight_decay=0.02)
    checkpoint, done = latest_checkpoint(out), 0
    if checkpoint is not None:
        done = read_position(checkpoint).total
        load_field_state(checkpoint, network)
        load_optimizer_state(checkpoint, optimizer)
        log.info("going on from step %d of %d", done, settings.steps)
    network.train()
    mean = 0.0
    for step in range(done, settings.steps):
        generator = torch.Generator().manual_seed(settings.seed * 1_000_003 + step)
        torch.manual_seed(settings.seed * 1_000_003 + step)  # for dropout
        warm = min(1.0, (step + 1) / 50)
        rate = settings.rate * warm * 0.5 * (1 + math.cos(math.pi * step / settings.steps))
        for group in optimizer.param_groups:
            group["lr"] = rate
        chosen = torch.randint(len(views), (settings.batch,), generator=generator)
        points, normals, yaw = draw(views, chosen, config.points, settings.noise, generator)
        loss = loss_of(network(points, normals), yaw)
        optimizer.zero_grad(set_to_none=True)
        loss.backward()
        nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimizer.step()
        mean += (float(loss.detach()) - mean) * (0.02 if step > done else 1.0)
        if (step + 1) % CHECKPOINT_EVERY == 0 or step + 1 == settings.steps:
            save_checkpoint(out, Position(0, step + 1, step + 1), network, optimizer, None)
            path = out / METRICS
            with writing(path), open(path, "a", encoding="utf-8") as file:
                file.write(json.dumps({"step": step + 1, "loss": round(mean, 4)}) + "\n")
        if progress is not None:
            progress(step + 1, settings.steps)
    return network.eval()
