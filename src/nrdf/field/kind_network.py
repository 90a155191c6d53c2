"""Is this an object of the category, upright and facing forward: a small network that tells.

A set abstraction and a maximum over it (PointNet++, Qi et al. 2017) end in 32 answers: the object
in one of 24 orientations that take axes to axes, turned by some other angle about one of six
directions that may be up, tilted, or no object of the category. It is asked about the cloud in four
turns and about their mirror images, and the answers, turned back, are put together.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import torch
from torch import Tensor, nn

from nrdf.errors import ModelError
from nrdf.field.base import FieldConfig
from nrdf.field.weights import load_tensors
from nrdf.field.zoo import KIND, ZOO, find_weights, list_models
from nrdf.geometry.canonical import MIRROR, rotation_about_up
from nrdf.geometry.similarity import AXES, up_axis, upright

KIND_ZOO = ZOO / KIND
"""Folder of the networks that ship, with an index of its own; a network's name is its category."""
UPS = np.array([up_axis(name) for name in AXES])
"""(6, 3) directions that an object's up may have."""
ORIENTATIONS = np.round(
    [
        upright(up) @ rotation_about_up(np.pi / 2 * turn)
        for up in UPS[[1, 0, 2, 3, 4, 5]]
        for turn in range(4)
    ]
)
"""(24, 3, 3) rotations of an object from the canonical frame that take axes to axes, the first one
none at all. They are the answers 0 to 23."""
ASKEW = 24
"""The first of six answers: the object's up is `UPS[answer - ASKEW]`, its heading along no axis."""
TILTED, OTHER = 30, 31
"""Answers: an object of the category, its up along no axis; no object of the category."""
ANSWERS = 32


class KindConfig(FieldConfig):
    """Sizes of the network. points: it looks at."""

    points: int = 384
    centres: int = 96
    neighbours: int = 12
    local: int = 96
    width: int = 192


class KindNetwork(nn.Module):
    """Logits over the answers for clouds in any place and unit."""

    preset: ClassVar[str] = KIND

    def __init__(self, config: KindConfig | None = None) -> None:
        super().__init__()
        self.config = config or KindConfig()
        local, width = self.config.local, self.config.width
        self.local = nn.Sequential(*_layer(6, 48), *_layer(48, local))
        self.patches = nn.Sequential(*_layer(local + 3, width), *_layer(width, width + 64))
        self.head = nn.Sequential(
            *_layer(2 * (width + 64), width), nn.Dropout(0.2), nn.Linear(width, ANSWERS)
        )

    def forward(self, points: Tensor) -> Tensor:
        """(b, ANSWERS) logits for clouds (b, n, 3), whose points are in random order."""
        low, high = points.amin(1, keepdim=True), points.amax(1, keepdim=True)
        points = (points - (low + high) / 2) / (high - low).amax(2, keepdim=True)
        centres = points[:, : self.config.centres]
        index = torch.cdist(centres, points).topk(self.config.neighbours, 2, largest=False).indices
        rows = torch.arange(len(points), device=points.device)[:, None, None]
        place = points[rows, index]
        near = torch.cat([4 * (place - centres[:, :, None]), place], dim=-1)
        felt = self.local(near.flatten(0, 2)).view(*near.shape[:3], -1).amax(2)
        told = torch.cat([felt, centres], dim=-1)
        seen = self.patches(told.flatten(0, 1)).view(*told.shape[:2], -1)
        return self.head(torch.cat([seen.amax(1), seen.mean(1)], dim=-1))

    @torch.inference_mode()
    def probabilities(self, points: np.ndarray) -> np.ndarray:
        """(ANSWERS,) of a cloud (n, 3) in any place and unit, its points in random order.

        As many points are looked at as make up one of the clouds that the network was trained on
        for each time it is asked, or the same ones again where there are fewer.
        """
        count = self.config.points
        clouds = max(1, min(len(_SHOWN), len(points) // count))
        split = np.array_split(points[: clouds * count], clouds)
        shown = [split[i % clouds] @ turn.T for i, turn in enumerate(_SHOWN)]
        told = self(torch.as_tensor(np.stack(shown), dtype=torch.float32)).log_softmax(1).numpy()
        mean = np.mean([row[answer] for row, answer in zip(told, _ANSWERED, strict=True)], axis=0)
        likely = np.exp(mean - mean.max())
        return np.asarray(likely / likely.sum())


def orientation_of(rotation: np.ndarray) -> int:
    """The answer for an object turned by a rotation (3, 3) that takes axes to axes."""
    return int(np.abs(ORIENTATIONS - rotation).sum(axis=(1, 2)).argmin())


def up_of(answer: int) -> np.ndarray | None:
    """Where the object's up (3,) is, by an answer; None where that does not tell."""
    if answer >= TILTED:
        return None
    return UPS[answer - ASKEW] if answer >= ASKEW else ORIENTATIONS[answer] @ UPS[1]


def _answers(shown: np.ndarray) -> np.ndarray:
    """Which answer about a cloud that was moved by `shown` (3, 3), a turn, perhaps mirrored, is
    each of the answers about the cloud itself: (ANSWERS,)."""
    mirror = np.diag(MIRROR) if np.linalg.det(shown) < 0 else np.eye(3)
    turned = [orientation_of(shown @ rotation @ mirror) for rotation in ORIENTATIONS]
    ups = [ASKEW + int((UPS @ (shown @ up)).argmax()) for up in UPS]
    return np.array([*turned, *ups, TILTED, OTHER])


_SHOWN = [
    rotation_about_up(np.pi / 2 * turn) @ side
    for turn in range(4)
    for side in (np.eye(3), np.diag(MIRROR))
]
_ANSWERED = [_answers(shown) for shown in _SHOWN]


def load_kind_network(name: str | Path, zoo: Path = KIND_ZOO) -> tuple[KindNetwork, dict[str, Any]]:
    """The network of a category in the zoo, or of a weight file, and its metadata.

    Raises ModelError for an unknown name, and a file that is damaged or of another kind.
    """
    path = find_weights(name, zoo)
    metadata, tensors = load_tensors(path)
    if metadata.get("preset") != KIND:
        raise ModelError(
            f"{path} holds weights of preset '{metadata.get('preset')}', not what tells a kind of "
            "object; `nrdf model kind` trains what is needed here"
        )
    with torch.random.fork_rng(devices=[]):
        network = KindNetwork(KindConfig(**metadata["field"]))
    network.load_state_dict(tensors)
    return network.eval(), metadata


def find_kind_network(category: str) -> KindNetwork | None:
    """The zoo's network of a category, if it has one."""
    known = [entry.name for entry in list_models(KIND_ZOO)]
    return load_kind_network(category)[0] if category in known else None


def _layer(given: int, wanted: int) -> list[nn.Module]:
    return [nn.Linear(given, wanted, bias=False), nn.BatchNorm1d(wanted), nn.ReLU()]
