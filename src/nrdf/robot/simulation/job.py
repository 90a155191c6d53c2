"""What is simulated: a job's tool paths with the object that they are for."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from nrdf.errors import ProcessError
from nrdf.geometry.mesh import Mesh
from nrdf.geometry.similarity import up_axis
from nrdf.io.formats.mesh_file import load_mesh
from nrdf.process.bound_knowledge import BoundKnowledge, read_bound_knowledge
from nrdf.process.process import Process
from nrdf.reports.job_folder import KNOWLEDGE
from nrdf.robot.model.cell import upright_rotation
from nrdf.robot.simulation.job_surface import JobSurfaces, read_job_surfaces
from nrdf.surface.target_mesh import TargetMesh
from nrdf.toolpath.file import FILE, read_toolpaths
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.types import Job, ToolPath

_FARTHEST_M = 0.05  # that a waypoint may be from the object, beyond the stand-off


@dataclass(frozen=True)
class SimulationJob:
    """A job with the object that it is for.

    bound_knowledge: the job's own knowledge: the target in metres with its regions. surfaces: the
    object as it was given and as it was planned on, and regions. strategies: of each of the job's
    paths. upright: (3, 3), from the target's frame to one with z up and x
    where the object faces; origin: where that is from, in words; assumed: whether nothing says it.
    """

    job: Job
    bound_knowledge: BoundKnowledge
    surfaces: JobSurfaces
    strategies: tuple[Strategy, ...]
    upright: np.ndarray
    origin: str
    assumed: bool = False

    @property
    def points(self) -> np.ndarray:
        """The target's points (n, 3), m."""
        return self.bound_knowledge.cloud.points

    @property
    def normals(self) -> np.ndarray:
        """The target's normals (n, 3)."""
        normals = self.bound_knowledge.cloud.normals
        assert normals is not None  # read_simulation_job lets no other pass
        return normals

    def process_of(self, path: ToolPath) -> Process | None:
        """The process that made a tool path, as the job's knowledge has it; None where it has none
        of that label."""
        for region in self.bound_knowledge.knowledge.regions:
            for process in region.steps if region.name == path.region else []:
                if process.label == path.process:
                    return process
        return None

    def with_mesh(self, file: str | Path) -> SimulationJob:
        """The same with the mesh of a file, in metres, as the object that the arm meets.

        Raises DataError for a file that cannot be read, ProcessError for a mesh that is none.
        """
        mesh = TargetMesh.from_mesh(Mesh(*load_mesh(file)))
        surfaces = self.surfaces.with_mesh(mesh, f"mesh {Path(file).name}")
        return replace(self, surfaces=surfaces)


def read_simulation_job(folder: str | Path, up: str | None = None) -> SimulationJob:
    """A job's folder, as `nrdf transfer` writes it.

    up: an axis of the job's frame ("x" to "-z"), or "x y z", instead of what the job says.

    Raises ProcessError where it is no such folder or has no surface, where a tool path does
    not have the strategy that made it, and where tool paths and object do not fit each
    other: another frame or unit.
    """
    folder = Path(folder)
    job = read_toolpaths(folder)
    if not folder.is_dir():
        folder = folder.parent
    if not (folder / KNOWLEDGE).is_file():
        raise ProcessError(
            f"{folder} has no {KNOWLEDGE}, which says what the tool paths are on; give the whole "
            "folder that `nrdf transfer` wrote"
        )
    bound_knowledge = read_bound_knowledge(folder / KNOWLEDGE)
    if not job.paths:
        raise ProcessError("the job has no tool paths: no region was found or planned")
    frame = bound_knowledge.cloud.frame or "target"
    if job.frame != frame:
        raise ProcessError(
            f"the job's tool paths are in the frame '{job.frame}', its object in '{frame}'; "
            "transfer it again, so that both are in one"
        )
    if bound_knowledge.cloud.normals is None:
        raise ProcessError(f"the job's {bound_knowledge.knowledge.reference.cloud} has no normals")
    strategies = tuple(_strategy(bound_knowledge, path) for path in job.paths)
    radii: dict[str, float] = {}
    for path in job.paths:
        radii[path.region] = min(path.tool_radius_m, radii.get(path.region, np.inf))
    surfaces = read_job_surfaces(folder, bound_knowledge, radii)
    made = SimulationJob(job, bound_knowledge, surfaces, strategies, *_orientation(job, up))
    _check_frame(made)
    return made


def _strategy(bound_knowledge: BoundKnowledge, path: ToolPath) -> Strategy:
    what = f"the job's tool path '{path.process}' on '{path.region}'"
    if path.region not in bound_knowledge.regions:
        raise ProcessError(f"{what}: its {KNOWLEDGE} has no such region; transfer it again")
    if path.strategy is None:
        raise ProcessError(
            f"{what} has no strategy in its {FILE}, as an earlier nrdf wrote it: the simulation "
            "cannot tell what was to be worked; transfer it again"
        )
    return path.strategy


def _orientation(job: Job, up: str | None) -> tuple[np.ndarray, str, bool]:
    """`SimulationJob.upright`, where it is from, and whether it is assumed."""
    if up is not None:
        return upright_rotation(up_axis(up), job.forward), f"up is {up}, as given", False
    upright = upright_rotation(job.up, job.forward)
    if job.pose is None:
        said = "the job does not say how its object lies: taken to have +Y up and +X ahead"
        return upright, said, True
    return upright, "the object stands as the job's pose says", False


def _check_frame(simulation_job: SimulationJob) -> None:
    """Raise ProcessError where the tool paths are not on the object."""
    surface = simulation_job.surfaces.given
    for path, strategy in zip(simulation_job.job.paths, simulation_job.strategies, strict=True):
        positions = [s.positions for s in path.segments if s.kind == "process"]
        if not positions:
            raise ProcessError(f"the tool path on '{path.region}' has no process segment")
        distance = surface.nearest(np.concatenate(positions)).distances - strategy.standoff_m
        typical = float(np.median(distance))
        if typical > _FARTHEST_M:
            size = float(np.ptp(simulation_job.points, axis=0).max())
            raise ProcessError(
                f"the tool path on '{path.region}' is {typical:.3g} m from the object, which "
                f"measures {size:.3g} m: the two are in different units or frames; both must be in "
                "metres, in the target's frame"
            )
