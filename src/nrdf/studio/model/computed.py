"""What is computed of a session, as it goes from the process that computes to the page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from nrdf.geometry.mesh import Mesh
from nrdf.process.check import CheckedProcess
from nrdf.process.strategy import strategy_of
from nrdf.toolpath.tool_segments import contact_points


@dataclass(frozen=True)
class Plan:
    """A process step, planned on the reference.

    fault: why there is no plan, "" where there is one; checked: None where the step is invalid.
    region: the surface that it was planned on.
    """

    fault: str
    checked: CheckedProcess | None = None
    region: Mesh | None = None

    @property
    def lines(self) -> list[np.ndarray]:
        """The contact points (m, 3) of each line, on the surface, m."""
        if self.checked is None:
            return []
        strategy = strategy_of(self.checked.process)
        work = (segment for segment in self.checked.segments if segment.kind == "process")
        return [contact_points(segment, strategy) for segment in work]


@dataclass(frozen=True)
class CorrespondenceFeatures:
    """Correspondence features of several objects, by
    `nrdf.regions.reference.EncodedReference.correspondence_features`.

    objects: (n, 6) of the shown points, by object. reference: (k, 6) of the reference's working
    points; nearest: (m,) the working point of each point of its cloud.
    """

    objects: Mapping[str, np.ndarray]
    reference: np.ndarray
    nearest: np.ndarray

    def distances(self, index: int) -> dict[str, np.ndarray]:
        """Descriptor distances (k,) of each object's shown points to one of the reference."""
        picked = self.reference[self.nearest[index]]
        return {key: np.linalg.norm(f - picked, axis=1) for key, f in self.objects.items()}
