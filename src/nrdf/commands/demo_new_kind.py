"""The end of `nrdf demo`: an object of a kind that has no model of its own."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np

    from nrdf.io.cloud import PointCloud

KIND, REGION, PROCESS = "table", "top", "paint"
FOLDER = "another-kind"
_TAUGHT, _NEXT = 1_200_001, 1_200_003  # seeds of members that no training has seen
_HEIGHT_M = 0.75
_POINTS = 8192


@dataclass(frozen=True)
class NewKind:
    """What was found on an object of a kind without a model: note says which model stood in; iou,
    of points found and true; coverage of the tool path, None where there is none."""

    note: str
    iou: float
    coverage: float | None
    seconds: float


def transfer_new_kind(folder: Path, origin: dict[str, Any]) -> NewKind:
    """Teach painting the top of one table, and bring it to another one: knowledge, clouds, picture
    and job go into `FOLDER` in `folder`."""
    from nrdf.io.cloud import write_cloud
    from nrdf.process.bound_knowledge import read_bound_knowledge
    from nrdf.process.knowledge_file import write_knowledge
    from nrdf.process.limits import Limits
    from nrdf.process.model_choice import choose_model
    from nrdf.process.new_knowledge import new_knowledge
    from nrdf.process.transfer import ProcessTransfer
    from nrdf.regions.model import load_model
    from nrdf.reports.job_folder import panel_of, panel_of_reference, write_job_files
    from nrdf.viz.picture import draw_regions

    place = folder / FOLDER
    place.mkdir()
    taught, at = _table(_TAUGHT)
    target, true = _table(_NEXT)
    _write_mesh(place / f"{KIND}.ply", taught)
    write_cloud(place / f"{REGION}.ply", taught.select(at))
    _write_mesh(place / "next.ply", target)
    knowledge = new_knowledge(
        place / f"{KIND}.ply", KIND, place, [place / f"{REGION}.ply"], (PROCESS,)
    )
    write_knowledge(place / f"{KIND}.yaml", knowledge, explained=True)
    chosen = choose_model(KIND)
    bound = read_bound_knowledge(place / f"{KIND}.yaml")
    process_transfer = ProcessTransfer(bound, load_model(chosen.name))
    result = process_transfer.transfer(target)
    (place / "job").mkdir()
    write_job_files(place / "job", result, Limits(), "next", origin)
    found = result.regions[REGION].match.indices
    metrics = result.paths[0].metrics
    panels = [
        panel_of_reference(process_transfer, f"a {KIND}"),
        panel_of(result, "another one", "a kind without a model of its own"),
    ]
    draw_regions(panels, place / "picture.png")
    return NewKind(
        chosen.note,
        overlap(found, true),
        None if metrics is None else metrics.coverage,
        sum(result.seconds.values()),
    )


def overlap(indices: np.ndarray, truth: np.ndarray) -> float:
    """Intersection over union of found indices (k,) and a true mask (n,); 1 if both are empty."""
    common = int(truth[indices].sum())
    union = len(indices) + int(truth.sum()) - common
    return common / union if union else 1.0


def _table(seed: int) -> tuple[PointCloud, np.ndarray]:
    """A table's surface, in metres, and which of its points (n,) are on the region."""
    import numpy as np

    from nrdf.geometry.mesh import Mesh
    from nrdf.io.cloud import PointCloud
    from nrdf.shapes.families import get_family
    from nrdf.shapes.families.tessellation import tessellate

    family = get_family(KIND)
    member = family.member(seed)
    surface, shown = member.sample_surface(_POINTS, np.random.default_rng(seed)), tessellate(member)
    scale = _HEIGHT_M / np.ptp(surface.points[:, 1])
    mesh = Mesh(shown.vertices * scale, shown.faces)
    cloud = PointCloud(surface.points * scale, surface.normals, unit="m", mesh=mesh)
    return cloud, family.region_of(surface.coordinates) == REGION


def _write_mesh(path: Path, cloud: PointCloud) -> None:
    from nrdf.io.ply import write_ply_mesh

    assert cloud.mesh is not None
    write_ply_mesh(path, cloud.mesh.vertices, cloud.mesh.faces, ["unit m"])
