"""Training of the networks that estimate yaw: on simulated views of shapes, at random yaws."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor
from torch.nn import functional

from nrdf.errors import DataError
from nrdf.field.yaw_network import YawConfig, YawNetwork, yaw_rotations
from nrdf.training.camera_views import Views, draw_seen, load_views, split
from nrdf.training.provenance import list_shapes, provenance
from nrdf.training.small_networks import Settings, run_steps, small_run, write_small_network

_SPREAD = 1.0  # of the yaws that count as right, in bins


@dataclass(frozen=True)
class YawSettings(Settings):
    """Those of training what tells yaw."""


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
    shapes = [entry.path.stem for entry in kept]
    with small_run(YawNetwork.preset, config, category, settings, shapes, out, overwrite):
        views, validation = load_views(kept, category), load_views(held, category)
        torch.manual_seed(settings.seed)
        network = YawNetwork(config)

        def loss_at(generator: torch.Generator) -> Tensor:
            chosen = torch.randint(len(views), (settings.batch,), generator=generator)
            points, normals, yaw = draw(views, chosen, config.points, settings.noise, generator)
            return loss_of(network(points, normals), yaw)

        run_steps(network, settings, loss_at, out, progress)
        scores = validate(network, validation, settings)
        return write_small_network(out, network, category, settings, provenance(kept), scores)


def draw(
    views: Views, chosen: Tensor, count: int, noise: float, generator: torch.Generator
) -> tuple[Tensor, Tensor, Tensor]:
    """Clouds (b, count, 3) of the shapes `chosen` (b,), as `draw_seen` draws them, their normals,
    and the yaws (b,) (rad) by which they are turned."""
    points, normals = draw_seen(views, chosen, count, noise, generator)
    yaw = 2 * math.pi * torch.rand(len(chosen), generator=generator)
    rotation = yaw_rotations(yaw)
    return (
        torch.einsum("bij,bnj->bni", rotation, points),
        torch.einsum("bij,bnj->bni", rotation, normals),
        yaw,
    )


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
