"""A field of a few hundred weights and shapes of a few hundred points, for the training tests."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import torch
from torch import nn

from nrdf.field.base import Field, FieldConfig, Inverse
from nrdf.shapes.dataset import Correspondence, IndexRow, Shape, write_index, write_shape
from nrdf.training.config import TrainConfig, load_config
from nrdf.training.dataset import ShapeDataset


class TinyConfig(FieldConfig):
    encoder_points: int = 256
    width: int = 16
    dropout: float = 0.0


class TinyField(Field):
    preset = "tiny"
    Config = TinyConfig

    def __init__(self, config=None):
        super().__init__(config)
        width = self.config.width
        self.encoder = nn.Sequential(nn.Linear(6, width), nn.ReLU(), nn.Linear(width, width))
        self.norm = nn.BatchNorm1d(width)
        self.decoder = nn.Sequential(
            nn.Linear(width + 3, width), nn.ReLU(), nn.Dropout(self.config.dropout)
        )
        self.logit = nn.Linear(width, 1)
        self.inverse = nn.Sequential(nn.Linear(2 * width + 3, 32), nn.ReLU(), nn.Linear(32, 8))

    def embed(self, points, normals):
        return self.norm(self.encoder(torch.cat([points, normals], -1)).max(dim=1).values)

    def _hidden(self, z, points):
        return self.decoder(torch.cat([z[:, None].expand(-1, points.shape[1], -1), points], -1))

    def occupancy(self, z, queries):
        return self.logit(self._hidden(z, queries)).squeeze(-1)

    def describe(self, z, points, normals):
        return torch.cat([self._hidden(z, points), points], -1)

    def invert(self, z, k):
        out = self.inverse(torch.cat([z[:, None].expand(-1, k.shape[1], -1), k], -1))
        points = k[..., -3:] + 0.3 * out[..., :3].tanh()
        return Inverse(
            points, nn.functional.normalize(out[..., 3:6], dim=-1), out[..., 6], out[..., 7]
        )


@dataclass
class Ball:
    """An ellipsoid: exact occupancy, normals and correspondence (by direction from the centre)."""

    name: str
    category: str = "ball"
    source: str = "family-ball"
    radii: tuple[float, float, float] = (0.5, 0.3, 0.2)
    count: int = 300
    groups: tuple[str, ...] = ("family-ball",)
    missing: bool = False
    correspondences: dict = field(default_factory=dict)

    def __post_init__(self):
        rng = np.random.default_rng(sum(self.name.encode()))
        self.surface_points, self.surface_normals = self.on(rng, self.count)
        self.query_points = rng.uniform(-0.55, 0.55, (self.count, 3)).astype(np.float32)
        self.query_occupancies = self.inside(self.query_points)
        points, normals = self.on(np.random.default_rng(0), 200)
        weight = np.ones(200, np.float16)
        if self.missing:
            weight[:100] = 0
        for group in self.groups:
            self.correspondences[group] = Correspondence(points, normals, weight)

    def on(self, rng, count):
        direction = rng.normal(size=(count, 3))
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        points, normals = direction * self.radii, direction / self.radii
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        return points.astype(np.float32), normals.astype(np.float32)

    def inside(self, points):
        return ((points / np.array(self.radii)) ** 2).sum(-1) < 1


def balls(number=6, **kwargs) -> list[Ball]:
    rng = np.random.default_rng(1)
    return [
        Ball(f"ball-{i}", radii=(0.5, *rng.uniform(0.15, 0.45, 2)), **kwargs) for i in range(number)
    ]


def write_folder(folder, shapes: list[Ball], val: int = 2) -> None:
    """A data folder whose last `val` shapes are for validation."""
    rows = []
    for index, shape in enumerate(shapes):
        write_shape(
            folder / f"{shape.name}.npz",
            Shape(
                shape.name,
                shape.category,
                shape.source,
                shape.surface_points,
                shape.surface_normals,
                shape.query_points,
                shape.query_occupancies,
                shape.correspondences,
            ),
        )
        split = "train" if index < len(shapes) - val else "val"
        rows.append(IndexRow(shape.name, shape.source, split, "CC0"))
    write_index(folder, rows)


def tiny_config(**changes) -> TrainConfig:
    content = {
        "preset": "tiny",
        "field": {"dropout": 0.1},
        "data": {
            "encoder_points": 64,
            "queries": 32,
            "correspondences": 32,
            "cloud_points": 48,
            "surface_points": 300,
            "stored_queries": 300,
            "rolls": 2,
            "augment": {"scaling": 0.1, "warp": 0.03, "mirror": True, "noise": 0.01},
        },
        "stages": [
            {
                "name": "shape",
                "weights": {"occupancy": 1},
                "steps": 6,
                "batch_size": 4,
                "parts": ["encoder", "norm", "decoder", "logit"],
                "rate": 0.01,
            },
            {
                "name": "all",
                "weights": {"occupancy": 1, "correspondence": 1, "normal": 0.1, "existence": 0.1},
                "steps": 8,
                "batch_size": 4,
                "rate": 0.01,
                "schedule": "cosine",
                "warmup": 2,
            },
        ],
        "optimizer": {"name": "adamw", "clip": 1.0},
        "ema": 0.9,
        "checkpoint_every": 3,
        "validate_every": 5,
        "log_every": 2,
    }
    return load_config({**content, **changes})


def tiny_dataset(shapes=None, **changes) -> ShapeDataset:
    return ShapeDataset(shapes or balls(), tiny_config().data.model_copy(update=changes))
