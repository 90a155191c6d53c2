"""Points of one shape mapped onto another: the interface, whatever maps them."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from nrdf.field.encoded_cloud import EncodedCloud
from nrdf.regions.presence import PresenceRule

TRUST_SCALE = 0.2
"""Canonical distance at which trust has fallen to 1/e: between a target point and the mapped
reference, and for the error that is expected of a mapped point."""


class MappedPoints(NamedTuple):
    """Reference points mapped onto a target, canonical.

    points, normals: (m, 3). existence: (m,) in [0, 1], whether the target has such a point; error:
    (m,) that is to be expected of its place; 1 and 0 where nothing predicts them.
    displacement: (m, 3), how far refinement has moved the points.
    """

    points: np.ndarray
    normals: np.ndarray
    existence: np.ndarray
    error: np.ndarray
    displacement: np.ndarray

    def displaced(self, by: np.ndarray) -> MappedPoints:
        """The same, moved by (m, 3)."""
        return self._replace(points=self.points + by, displacement=self.displacement + by)

    @property
    def trust(self) -> np.ndarray:
        """(m,) in [0, 1]: that the point exists, and how small an error is expected."""
        return self.existence * np.exp(-self.error / TRUST_SCALE)

    def select(self, chosen: np.ndarray) -> MappedPoints:
        """The points at `chosen`, integers (k,) or a mask (m,)."""
        return MappedPoints(*(values[chosen] for values in self))


class SurfaceMapper(Protocol):
    """Maps the surface of one shape, the source, onto any number of targets, and back.

    A trained field (`nrdf.regions.field_mapper`) and a registration
    (`nrdf.regions.registration_mapper`) do. Points and normals (m, 3) are canonical.
    """

    presence_rule: PresenceRule
    """How the presence of regions is told from what this predicts."""

    def map_working(self, target: EncodedCloud, chosen: np.ndarray | None = None) -> MappedPoints:
        """The source's working points, or those `chosen` (m,) of them, on a target."""
        ...

    def map_points(
        self, points: np.ndarray, normals: np.ndarray, target: EncodedCloud
    ) -> MappedPoints:
        """Any points of the source's surface on a target."""
        ...

    def map_precisely(
        self, points: np.ndarray, normals: np.ndarray, target: EncodedCloud
    ) -> MappedPoints:
        """As `map_points`, as exactly as can be, however long it takes."""
        ...

    def map_back(self, target: EncodedCloud, chosen: np.ndarray | slice) -> MappedPoints:
        """A target's working points at `chosen` (m,) on the source."""
        ...
