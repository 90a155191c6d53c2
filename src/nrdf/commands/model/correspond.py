"""`nrdf model correspond`: correspondences between training shapes."""

from __future__ import annotations

from tyro.conf import Positional

from nrdf.commands.console import console, progress_bar
from nrdf.commands.options import Cluster, Folder
from nrdf.commands.output_lock import lock_output
from nrdf.io.bounds import Count
from nrdf.tasks import chosen_workers


@lock_output("data")
def correspond(
    data: Positional[tuple[Folder, ...]],
    templates: Count = 12,
    templates_from: Folder | None = None,
    meshes: Folder | None = None,
    workers: Count | None = None,
    cluster: Cluster | None = None,
) -> None:
    """Add correspondences between shapes, by registering templates.

    A few shapes that stand for all are registered to every one (about 0.2 s a pair on one core).
    Started again, it goes on where it was.

    Example: nrdf model correspond data/chair --templates 10

    Args:
        data: Data folders of one category (of `nrdf model prepare`, `synth` or `boxes`).
        templates: Number of shapes that serve as templates; all shapes where there are fewer.
        templates_from: The folder whose shapes may serve as templates; all of them unless given.
            Boxes, for instance, are good to learn from and poor as templates.
        meshes: Folder of the meshes that the first data folder was prepared from: those that share
            their triangulation get exact correspondences too, vertex by vertex.
        workers: Processes; all cores unless given.
        cluster: Address of a Dask scheduler whose workers do it instead.
    """
    from nrdf.errors import ConfigError
    from nrdf.shapes.correspond import correspond_folders
    from nrdf.shapes.topology import add_shared_topology

    if not data:
        raise ConfigError("nrdf model correspond needs one or more data folders")
    if meshes is not None:
        for name, shapes in add_shared_topology(meshes.iterdir(), data[0]).items():
            console.print(f"{len(shapes)} shapes share their triangulation: group {name}")
    cores = chosen_workers(workers, cluster)
    with progress_bar("shapes registered") as progress:
        report = correspond_folders(list(data), templates, cores, None, progress, templates_from)
    console.print(
        f"{report.done} shapes registered, {report.skipped} were before; "
        f"templates: {', '.join(report.templates)}"
    )
