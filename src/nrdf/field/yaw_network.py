"""A small network that estimates the yaw of an object from a cloud whose up is known.

A set abstraction and a maximum over it (PointNet++, Qi et al. 2017) end in a distribution over the
full circle of yaws. The network sees the cloud at several yaws, each with its mirror image; the
outputs, turned back, are averaged: what it learned of one direction counts in all.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import torch
from torch import Tensor, nn

from nrdf.errors import ModelError
from nrdf.field.base import FieldConfig
from nrdf.field.weights import fill, load_tensors
from nrdf.field.zoo import YAW, ZOO, find_weights, list_models

YAW_ZOO = ZOO / YAW
"""Folder of the networks that ship, with an index of its own; a network's name is its category."""
_VIEWS = 6  # yaws at which a cloud is shown, each as it is and mirrored
_CLOUDS = 2  # of different points, likewise
_FAR = 0.95  # share of the points whose distance from their middle is the unit of length


class YawConfig(FieldConfig):
    """Sizes of the network. bins: of the circle, a multiple of 12. points: it looks at."""

    bins: int = 36
    points: int = 256
    centres: int = 64
    neighbours: int = 12
    local: int = 96
    width: int = 192


class YawNetwork(nn.Module):
    """Logits over yaws of clouds with +Y up."""

    preset: ClassVar[str] = YAW

    def __init__(self, config: YawConfig | None = None) -> None:
        super().__init__()
        self.config = config or YawConfig()
        local, width = self.config.local, self.config.width
        self.local = nn.Sequential(*_layer(7, 48), *_layer(48, local))
        self.patches = nn.Sequential(*_layer(local + 6, width), *_layer(width, width + 64))
        self.head = nn.Sequential(
            *_layer(2 * (width + 64), width), nn.Dropout(0.2), nn.Linear(width, self.config.bins)
        )

    def forward(self, points: Tensor, normals: Tensor) -> Tensor:
        """(b, bins) logits that the objects of clouds (b, n, 3), normals (b, n, 3), are turned by
        yaw 2π i / bins about +Y. The points are in random order, in any unit."""
        points = _normalised(points)
        count, neighbours = self.config.centres, self.config.neighbours
        centres, centre_normals = points[:, :count], normals[:, :count]
        index = torch.cdist(centres, points).topk(neighbours, dim=2, largest=False).indices
        rows = torch.arange(len(points), device=points.device)[:, None, None]
        offset = 4 * (points[rows, index] - centres[:, :, None])
        near = torch.cat([offset, normals[rows, index], points[rows, index][..., 1:2]], dim=-1)
        local = self.local(near.flatten(0, 2)).view(*near.shape[:3], -1).amax(2)
        local = torch.cat([local, centres, centre_normals], dim=-1)
        patches = self.patches(local.flatten(0, 1)).view(*local.shape[:2], -1)
        return self.head(torch.cat([patches.amax(1), patches.mean(1)], dim=-1))

    @torch.inference_mode()
    def log_probability(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """(bins,) log probabilities of the yaws 2π i / bins of a cloud (n, 3), +Y up, any unit.

        normals: (n, 3) outward. The points are in random order; as many are looked at as make up
        two of the clouds that the network was trained on, or once over if there are fewer.
        """
        bins, count = self.config.bins, self.config.points
        clouds = max(1, min(_CLOUDS, len(points) // count))
        p, n = (
            torch.as_tensor(v[: clouds * count], dtype=torch.float32).reshape(clouds, -1, 3)
            for v in (points, normals)
        )
        steps = [bins // _VIEWS * i for i in range(_VIEWS)]
        rotations = yaw_rotations(2 * math.pi / bins * torch.tensor(steps))
        p, n = (torch.einsum("tij,cnj->tcni", rotations, v) for v in (p, n))
        mirror = torch.tensor([1.0, 1.0, -1.0])
        shown = [torch.stack([v, v * mirror], 1).flatten(0, 2) for v in (p, n)]
        logits = self(*shown).log_softmax(1).view(_VIEWS, 2, clouds, bins)
        # A mirror image faces minus the yaw.
        logits[:, 1] = logits[:, 1].flip(-1).roll(1, -1)
        turned = [
            row.roll(-step, -1)
            for side in logits.unbind(1)
            for row, step in zip(side, steps, strict=True)
        ]
        return torch.cat(turned).mean(0).log_softmax(0).numpy()


def yaw_rotations(yaw: Tensor) -> Tensor:
    """Rotations (..., 3, 3) by `yaw` (...) (rad) about +Y."""
    c, s, zero = yaw.cos(), yaw.sin(), torch.zeros_like(yaw)
    rows = [[c, zero, s], [zero, zero + 1, zero], [-s, zero, c]]
    return torch.stack([torch.stack(row, -1) for row in rows], -2)


def log_probability_at(log_probability: np.ndarray, yaws: np.ndarray | float) -> np.ndarray:
    """Values (...) of a distribution (bins,) over the circle at `yaws` (...) (rad), interpolated,
    relative to its highest."""
    bins = len(log_probability)
    place = np.asarray(yaws) / (2 * np.pi) * bins
    first = np.floor(place).astype(int)
    share = place - first
    low, high = log_probability[first % bins], log_probability[(first + 1) % bins]
    return (1 - share) * low + share * high - log_probability.max()


def load_yaw_network(name: str | Path, zoo: Path = YAW_ZOO) -> tuple[YawNetwork, dict[str, Any]]:
    """The network of a category in the zoo, or of a weight file, and its metadata.

    Raises ModelError for an unknown name, and a file that is damaged or of another kind.
    """
    path = find_weights(name, zoo)
    metadata, tensors = load_tensors(path)
    if metadata.get("preset") != YAW:
        raise ModelError(
            f"{path} holds a field of preset '{metadata.get('preset')}', not yaws; "
            "`nrdf model yaw` trains what is needed here"
        )
    network = fill(path, YAW, tensors, lambda: YawNetwork(YawConfig(**metadata["field"])))
    return network, metadata


def find_yaw_network(category: str) -> YawNetwork | None:
    """The zoo's network of a category, if it has one."""
    known = [entry.name for entry in list_models(YAW_ZOO)]
    return load_yaw_network(category)[0] if category in known else None


def _layer(given: int, wanted: int) -> list[nn.Module]:
    return [nn.Linear(given, wanted, bias=False), nn.BatchNorm1d(wanted), nn.ReLU()]


def _normalised(points: Tensor) -> Tensor:
    """Points (b, n, 3) about their middle, heights above the lowest, about 1 in size: the same at
    every yaw."""
    middle = points.mean(1, keepdim=True)
    low = points[..., 1].amin(1)
    from_middle = points - middle
    size = from_middle.norm(dim=-1).quantile(_FAR, dim=1)[:, None, None]
    heights = torch.zeros_like(middle)
    heights[:, 0, 1] = middle[:, 0, 1] - low
    return (from_middle + heights) / size
