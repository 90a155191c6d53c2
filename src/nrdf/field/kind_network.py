"""A small network that classifies a cloud: of the category, and how oriented, or of another kind.

A set abstraction and a maximum over it (PointNet++, Qi et al. 2017) end in 32 classes: the object
in one of 24 orientations that take axes to axes, turned by some other angle about one of six
directions that may be up, tilted, or no object of the category. The network sees the cloud at four
yaws, each with its mirror image; the outputs, brought back to the cloud itself, are averaged.
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
        upright(up) @ rotation_about_up(np.pi / 2 * quarter)
        for up in UPS[[1, 0, 2, 3, 4, 5]]
        for quarter in range(4)
    ]
)
"""(24, 3, 3) rotations of an object from the canonical frame that take axes to axes, the first one
the identity. They are the classes 0 to 23."""
ASKEW = 24
"""The first of six classes: the object's up is `UPS[kind - ASKEW]`, its heading along no axis."""
TILTED, OTHER = 30, 31
"""Classes: an object of the category, its up along no axis; no object of the category."""
CLASSES = 32


class KindConfig(FieldConfig):
    """Sizes of the network. points: it looks at."""

    points: int = 384
    centres: int = 96
    neighbours: int = 12
    local: int = 96
    width: int = 192


class KindNetwork(nn.Module):
    """Logits over the classes for clouds in any place and unit."""

    preset: ClassVar[str] = KIND

    def __init__(self, config: KindConfig | None = None) -> None:
        super().__init__()
        self.config = config or KindConfig()
        local, width = self.config.local, self.config.width
        self.local = nn.Sequential(*_layer(6, 48), *_layer(48, local))
        self.patches = nn.Sequential(*_layer(local + 3, width), *_layer(width, width + 64))
        self.head = nn.Sequential(
            *_layer(2 * (width + 64), width), nn.Dropout(0.2), nn.Linear(width, CLASSES)
        )

    def forward(self, points: Tensor) -> Tensor:
        """(b, CLASSES) logits for clouds (b, n, 3), whose points are in random order."""
        low, high = points.amin(1, keepdim=True), points.amax(1, keepdim=True)
        points = (points - (low + high) / 2) / (high - low).amax(2, keepdim=True)
        centres = points[:, : self.config.centres]
        index = torch.cdist(centres, points).topk(self.config.neighbours, 2, largest=False).indices
        rows = torch.arange(len(points), device=points.device)[:, None, None]
        place = points[rows, index]
        near = torch.cat([4 * (place - centres[:, :, None]), place], dim=-1)
        local = self.local(near.flatten(0, 2)).view(*near.shape[:3], -1).amax(2)
        local = torch.cat([local, centres], dim=-1)
        patches = self.patches(local.flatten(0, 1)).view(*local.shape[:2], -1)
        return self.head(torch.cat([patches.amax(1), patches.mean(1)], dim=-1))

    @torch.inference_mode()
    def probabilities(self, points: np.ndarray) -> np.ndarray:
        """(CLASSES,) of a cloud (n, 3) in any place and unit, its points in random order.

        Each of the eight views of the cloud takes other points of it, as many as the network was
        trained with; the same ones again where there are fewer.
        """
        count = self.config.points
        clouds = max(1, min(len(_VIEWS), len(points) // count))
        split = np.array_split(points[: clouds * count], clouds)
        shown = [split[i % clouds] @ view.T for i, view in enumerate(_VIEWS)]
        logits = self(torch.as_tensor(np.stack(shown), dtype=torch.float32)).log_softmax(1).numpy()
        mean = np.mean([row[of] for row, of in zip(logits, _CLASS_IN_VIEW, strict=True)], axis=0)
        likely = np.exp(mean - mean.max())
        return np.asarray(likely / likely.sum())


def orientation_of(rotation: np.ndarray) -> int:
    """The class of an object turned by a rotation (3, 3) that takes axes to axes."""
    return int(np.abs(ORIENTATIONS - rotation).sum(axis=(1, 2)).argmin())


def up_of(kind: int) -> np.ndarray | None:
    """Direction (3,) of the object's up, by its class; None where the class does not tell it."""
    if kind >= TILTED:
        return None
    return UPS[kind - ASKEW] if kind >= ASKEW else ORIENTATIONS[kind] @ UPS[1]


def _class_in_view(view: np.ndarray) -> np.ndarray:
    """The class (CLASSES,) that a cloud of each class has in a view of it.

    view: (3, 3), a rotation about up, perhaps of the mirror image.
    """
    mirror = np.diag(MIRROR) if np.linalg.det(view) < 0 else np.eye(3)
    turned = [orientation_of(view @ rotation @ mirror) for rotation in ORIENTATIONS]
    ups = [ASKEW + int((UPS @ (view @ up)).argmax()) for up in UPS]
    return np.array([*turned, *ups, TILTED, OTHER])


_VIEWS = [
    rotation_about_up(np.pi / 2 * quarter) @ side
    for quarter in range(4)
    for side in (np.eye(3), np.diag(MIRROR))
]
_CLASS_IN_VIEW = [_class_in_view(view) for view in _VIEWS]


def load_kind_network(name: str | Path, zoo: Path = KIND_ZOO) -> tuple[KindNetwork, dict[str, Any]]:
    """The network of a category in the zoo, or of a weight file, and its metadata.

    Raises ModelError for an unknown name, and a file that is damaged or of another kind.
    """
    path = find_weights(name, zoo)
    metadata, tensors = load_tensors(path)
    if metadata.get("preset") != KIND:
        raise ModelError(
            f"{path} holds weights of preset '{metadata.get('preset')}', not of a network "
            "for the kind of object; `nrdf model kind` trains what is needed here"
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
