"""`nrdf eval scans`: poses and regions on simulated scans with known truth."""

from __future__ import annotations

from typing import Literal

from nrdf.commands.console import command_line, console, progress_bar, show, table, versions
from nrdf.commands.options import File, Folder
from nrdf.commands.output_lock import lock_output
from nrdf.io.bounds import Count, NonNegativeCount


@lock_output("out")
def scans(
    category: Literal["chair", "car", "plane"],
    model: str | None = None,
    members: NonNegativeCount = 25,
    meshes: Folder | None = None,
    every: Count = 1,
    pairs: NonNegativeCount = 25,
    device: str = "cpu",
    out: File | None = None,
) -> None:
    """Alignment, and regions on scans, against exact truth.

    Full clouds, and simulated scans of three views and of one with a floor and 1 mm of noise on a
    0.9 m object, at any yaw, scale and offset. Poses of unseen members of the category's family,
    and of meshes; regions on pairs of members. docs/evidence/scans.md defines the results.

    Example: nrdf eval scans --category chair --meshes shapes/

    Args:
        category: chair, car or plane.
        model: Zoo name, weight file or run; the category's model in the zoo unless given.
        members: Members of the family whose poses are found.
        meshes: Folder with index.csv (category, shape, split) and category/shape.ply; those of the
            test split are used.
        every: Use every so manieth of the meshes.
        pairs: Pairs of members on which regions are found.
        device: cpu, cuda, cuda:N or auto.
        out: JSON file to write, with every single result.
    """
    from itertools import chain, islice

    import nrdf
    from nrdf.io.atomic import write_json
    from nrdf.scans.pose_scorer import PoseScorer
    from nrdf_benchmark import scans as benchmark

    scorer = PoseScorer(nrdf.load_model(model or category, device))
    found = (
        [] if meshes is None else list(islice(benchmark.meshes(meshes, category), 0, None, every))
    )
    with progress_bar(f"scans of {category}s") as progress:
        poses, regions = benchmark.evaluate_scans(
            scorer,
            lambda: chain(benchmark.members(category, members), found),
            members + len(found),
            pairs,
            progress,
        )
    rows = benchmark.summary(poses, regions)
    shown = table("", category, "", "value", "of")
    for kind, what, value, count in rows:
        shown.add_row(kind, what, f"{value:.4f}", str(count))
    show(shown)
    if out is not None:
        content = {
            "command": command_line(),
            "versions": versions(),
            "summary": [
                dict(zip(("kind", "what", "value", "of"), row, strict=True)) for row in rows
            ],
            "poses": [vars(pose) for pose in poses],
            "regions": [vars(region) for region in regions],
        }
        write_json(out, content)
        console.print(f"wrote {out}")
