"""The interface that every field has, whatever network is behind it.

A field is trained for one category. It embeds a shape (z), gives points on it descriptors (k, by
the paper's descriptor function θ), and finds the point of another shape that a descriptor belongs
to (C, the inverse descriptor function).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar, NamedTuple

from pydantic import BaseModel, ConfigDict, model_validator
from torch import Tensor, nn

_LARGEST_SIZE = 1_000_000


class FieldConfig(BaseModel):
    """Base of a preset's sizes; unknown keys are refused, and what is no size."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    @model_validator(mode="after")
    def _are_sizes(self) -> FieldConfig:
        for name, value in self:
            if isinstance(value, (int, float)) and not 0 <= value <= _LARGEST_SIZE:
                raise ValueError(f"{name} must be 0 to {_LARGEST_SIZE}, not {value}")
        if getattr(self, "encoder_points", 1) < 1:
            raise ValueError("encoder_points must be at least 1")
        return self


class Inverse(NamedTuple):
    """Output of the inverse descriptor function for m descriptors on each of b targets."""

    points: Tensor
    """(b, m, 3) canonical coordinates on the target."""
    normals: Tensor | None = None
    """(b, m, 3) unit outward normals there, when the field predicts them."""
    existence: Tensor | None = None
    """(b, m) logits: does the target have a corresponding point at all?"""
    log_error: Tensor | None = None
    """(b, m) logarithm of the error that the field expects of `points`."""
    coarse_points: Tensor | None = None
    """(b, m, 3) the prediction before its refinement, when the field has one."""


class Field(nn.Module, ABC):
    """Shape embedding, descriptor field and inverse descriptor function of one category.

    A subclass names its `preset`, gives its sizes as a `Config`, and builds itself from one. The
    names of its direct children are the parts that a training stage can freeze.
    """

    preset: ClassVar[str]
    Config: ClassVar[type[FieldConfig]]
    inverts: ClassVar[bool] = True
    """Whether there is an inverse descriptor function; without, `invert` raises ModelError."""

    def __init__(self, config: FieldConfig | None = None) -> None:
        super().__init__()
        self.config: Any = config if config is not None else self.Config()

    @abstractmethod
    def embed(self, points: Tensor, normals: Tensor) -> Tensor:
        """Shape embedding z (b, d_z) of points (b, n, 3) with unit outward normals (b, n, 3)."""

    @abstractmethod
    def occupancy(self, z: Tensor, queries: Tensor) -> Tensor:
        """Logits (b, q) that queries (b, q, 3) lie inside the shapes of embeddings z (b, d_z)."""

    def coarse_occupancy(self, z: Tensor, queries: Tensor) -> Tensor:
        """The same by what descriptors are made of alone, where a field tells occupancy apart from
        them; otherwise `occupancy`."""
        return self.occupancy(z, queries)

    @abstractmethod
    def describe(self, z: Tensor, points: Tensor, normals: Tensor) -> Tensor:
        """Descriptors k (b, m, d_k) of points (b, m, 3) with normals, on the shapes of z."""

    @abstractmethod
    def invert(self, z: Tensor, k: Tensor) -> Inverse:
        """The points on the shapes of z (b, d_z) that descriptors k (b, m, d_k) belong to."""

    def prepare(self, k: Tensor) -> Tensor:
        """What of `invert` depends on descriptors k (b, m, d_k) alone, for several targets; k
        itself unless a field overrides it, together with `invert_prepared`."""
        return k

    def invert_prepared(self, z: Tensor, prepared: Tensor) -> Inverse:
        """`invert(z, k)`, where `prepared` is `prepare(k)`."""
        return self.invert(z, prepared)

    def transfer(
        self, z_reference: Tensor, points: Tensor, normals: Tensor, z_target: Tensor
    ) -> Inverse:
        """The points of targets that correspond to points (b, m, 3) of references.

        Equal to `invert(z_target, describe(z_reference, points, normals))`; a field overrides it
        where the two together can be computed more cheaply.
        """
        return self.invert(z_target, self.describe(z_reference, points, normals))

    def parts(self) -> dict[str, nn.Module]:
        """The direct children by name: what a training stage can train or freeze."""
        return dict(self.named_children())
