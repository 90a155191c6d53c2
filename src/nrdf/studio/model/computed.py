"""What is computed of a session, as it goes from the process that computes to the page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nrdf.geometry.mesh import Mesh
from nrdf.process.check import CheckedProcess
from nrdf.process.process import Process
from nrdf.process.result_target import result_settings
from nrdf.process.strategy import strategy_of
from nrdf.process_model.plan import PlannedResult
from nrdf.toolpath.tool_segments import contact_points
from nrdf.viz.heat_map import levels_of


@dataclass(frozen=True)
class LeftResult:
    """The film or depth that a process leaves on a region: values (f,), m, on triangles of a mesh.

    target_m, tolerance_m: what is wanted; within: the share of the area that has it, at_one_feed:
    that would have it without planned feeds. film: whether it is film.
    """

    region: str
    mesh: Mesh
    values: np.ndarray
    target_m: float
    tolerance_m: float
    within: float
    at_one_feed: float
    film: bool

    @property
    def what(self) -> str:
        """What it is."""
        return "film" if self.film else "depth"

    @cached_property
    def level_meshes(self) -> dict[int, Mesh]:
        """The triangles of each range of `nrdf.viz.heat_map.LEVELS` that there is."""
        made = {}
        levels = levels_of(self.values, self.target_m, self.tolerance_m)
        for level in np.unique(levels).tolist():
            used, faces = np.unique(self.mesh.faces[levels == level], return_inverse=True)
            made[level] = Mesh(self.mesh.vertices[used], faces.reshape(-1, 3))
        return made

    @staticmethod
    def of(region: str, process: Process, planned: PlannedResult | None) -> LeftResult | None:
        """Of a process whose result was planned; None without one."""
        settings = result_settings(process)
        if settings is None or planned is None:
            return None
        cells, target = planned.model.cells, settings.target
        return LeftResult(
            region, Mesh(cells.fine.vertices, cells.fine.faces),
            cells.of_region(planned.model.values()), target.value_m, target.tolerance_m,
            planned.metrics.within, planned.taught.within, process.thickness_um is not None,
        )  # fmt: skip


@dataclass(frozen=True)
class Plan:
    """A process step, planned on the reference.

    fault: why there is no plan, "" where there is one; checked: None where the step is invalid.
    region: the surface that it was planned on; left: what it leaves there, where that is wanted.
    """

    fault: str
    checked: CheckedProcess | None = None
    region: Mesh | None = None
    left: LeftResult | None = None

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
