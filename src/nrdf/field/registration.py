"""The model `registration`: nothing is trained, so it serves objects of every category.

It stands where a trained field stands, but has no descriptors: what corresponds is found for each
pair of objects by smooth non-rigid registration (`nrdf.shapes.registration`), which
`nrdf.regions.registration_mapper` does.
"""

from __future__ import annotations

from typing import Any, Final, NoReturn

import torch
from torch import Tensor

from nrdf.errors import ModelError
from nrdf.field.base import Field, FieldConfig

REGISTRATION: Final = "registration"
"""Name of the model, wherever a model is named, and its preset."""
METADATA: dict[str, Any] = {
    "preset": REGISTRATION,
    "category": "",
    "name": REGISTRATION,
    "note": "trained on nothing; for objects of any category",
}


class RegistrationConfig(FieldConfig):
    """There is nothing to choose."""

    encoder_points: int = 100_000
    """More than any cloud has in use, so that no subset is drawn."""


class RegistrationField(Field):
    """Stands for a field where there is none: no embedding, no occupancy, no descriptors."""

    preset = REGISTRATION
    inverts = False
    Config = RegistrationConfig

    def embed(self, points: Tensor, normals: Tensor) -> Tensor:
        """Empty embeddings (b, 0): a registration sees the points themselves."""
        return torch.zeros(len(points), 0, device=points.device)

    def occupancy(self, z: Tensor, queries: Tensor) -> NoReturn:
        """Raises ModelError."""
        raise _has_no("occupancy")

    def describe(self, z: Tensor, points: Tensor, normals: Tensor) -> NoReturn:
        """Raises ModelError."""
        raise _has_no("descriptors")

    def invert(self, z: Tensor, k: Tensor) -> NoReturn:
        """Raises ModelError."""
        raise _has_no("descriptors")


def _has_no(what: str) -> ModelError:
    return ModelError(f"the model registration has no {what}: give a trained field")
