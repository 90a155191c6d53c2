"""`nrdf eval kind`: is this the kind of object, upright, facing forward?"""

from __future__ import annotations

from typing import Literal

from nrdf.commands.console import command_line, console, progress_bar, show, table, versions
from nrdf.commands.options import File, Folder
from nrdf.io.bounds import Count, NonNegativeCount


def kind(
    category: Literal["chair", "car", "plane"],
    shapes: Folder | None = None,
    bsrc: Folder | None = None,
    labelled: Folder | None = None,
    others: Folder | None = None,
    count: Count = 200,
    scans_every: NonNegativeCount = 0,
    network: str | None = None,
    out: File | None = None,
) -> None:
    """What the check of the kind of object warns of, and what it lets pass.

    Real objects of the category, as they are and turned, and objects of other kinds; with
    --scans-every also simulated scans of three views, after alignment. Nothing of it was trained
    on: docs/evidence/scans.md.

    Example: nrdf eval kind --category chair --shapes shapes/ --bsrc bsrc/ --labelled objects/ikea/
    --others objects/m3/

    Args:
        category: chair, car or plane.
        shapes: Folder with index.csv (category, shape, split) and category/shape.ply; those of the
            test split are used.
        bsrc: BSRC's folder; its clouds are taken as they are.
        labelled: Labelled meshes, as `nrdf eval objects` takes them; those of the category, and
            other furniture, of which some is sat on too, without a bar.
        others: Folder of meshes of everyday objects, +Y up, any heading; of the half that training
            leaves out, those are drawn that are none of the category by their names.
        count: How many of them.
        scans_every: Scan every so manieth of the test meshes; 0 for none.
        network: Zoo name, weight file or run; the category's unless given.
        out: JSON file to write, with every single cloud.
    """
    import nrdf
    from nrdf.errors import DataError
    from nrdf.field.kind_network import load_kind_network
    from nrdf.io.atomic import write_json
    from nrdf.scans.pose_scorer import PoseScorer
    from nrdf_benchmark import kind as benchmark

    if scans_every and shapes is None:
        raise DataError("--scans-every scans meshes: give their folder as --shapes")
    asked, metadata = load_kind_network(network or category)
    right = list(benchmark.real_objects(category, shapes, bsrc, labelled))
    foreign = [] if others is None else benchmark.other_objects(others, category, count)
    with progress_bar("objects") as progress:
        results = benchmark.evaluate_kind(asked, category, right, foreign, progress)
    if labelled is not None:
        results += benchmark.check_furniture(asked, category, labelled)
    if scans_every and shapes is not None:
        model = nrdf.load_model(category)
        model.kind_network = asked
        results += benchmark.check_scans(PoseScorer(model), shapes, scans_every)
    rows = benchmark.summary(results)
    shown = table("", category, "with a warning", "of", "share", "bar")
    for what, warned, of, bar in rows:
        shown.add_row(what, str(warned), str(of), f"{warned / max(of, 1):.1%}", bar)
    show(shown)
    if out is not None:
        write_json(out, {
            "command": command_line(),
            "versions": versions(),
            "network": metadata,
            "summary": [dict(zip(("what", "warned", "of", "bar"), r, strict=True)) for r in rows],
            "clouds": [vars(result) for result in results],
        })  # fmt: skip
        console.print(f"wrote {out}")
