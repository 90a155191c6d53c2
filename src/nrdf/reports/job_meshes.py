"""The meshes of a job's folder: the object's surface that was planned on, and each region's."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from nrdf.errors import DataError, ProcessError
from nrdf.io.formats.mesh_file import load_mesh
from nrdf.io.ply import write_ply_mesh
from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.target_mesh import TargetMesh

SURFACE, REGION_MESHES = "surface.ply", "region_meshes"
"""File of the object's mesh, and folder of the regions' meshes, in a job's folder."""


@dataclass(frozen=True)
class JobMeshes:
    """surface: the object's mesh, in metres, in the job's frame. regions: name to mesh, of every
    region that was planned on; all have `surface` as parent."""

    surface: TargetMesh
    regions: dict[str, RegionMesh]


def write_job_meshes(
    folder: Path, surface: TargetMesh, regions: Mapping[str, RegionMesh], frame: str | None = None
) -> None:
    """Write surface.ply and region_meshes/NAME.ply, binary PLY in metres, into a job's folder.

    Regions' names are file names, as knowledge asks of them. Raises OutputError where a file cannot
    be written.
    """
    comments = ["unit m", *([f"frame {frame}"] if frame else [])]
    write_ply_mesh(folder / SURFACE, surface.vertices, surface.faces, comments)
    (folder / REGION_MESHES).mkdir(exist_ok=True)
    for name, region in regions.items():
        place = folder / REGION_MESHES / f"{name}.ply"
        write_ply_mesh(place, region.mesh.vertices, region.mesh.faces, comments)


def read_job_meshes(folder: str | Path) -> JobMeshes:
    """The meshes of a job's folder, as `nrdf transfer` writes it.

    Raises ProcessError where the folder has none, or a file is damaged.
    """
    folder = Path(folder)
    if not (folder / SURFACE).is_file():
        raise ProcessError(
            f"{folder} has no {SURFACE}, the mesh that its tool paths were planned on: an earlier "
            "nrdf wrote it, or it is no job; transfer it again"
        )
    surface = _read(folder / SURFACE)
    files = sorted((folder / REGION_MESHES).glob("*.ply"))
    return JobMeshes(surface, {file.stem: RegionMesh(_read(file), surface) for file in files})


def _read(file: Path) -> TargetMesh:
    try:
        return TargetMesh(*load_mesh(file))
    except DataError as error:
        raise ProcessError(f"{error}; transfer the job again") from error
