"""`nrdf eval toolpaths`: tool paths planned on known regions, and on real meshes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from nrdf.commands.console import command_line, console, progress_bar, show, table, versions
from nrdf.commands.options import Folder, Metavar
from nrdf.commands.output_lock import lock_output
from nrdf.io.bounds import Count, NonNegative, NonNegativeCount
from nrdf.toolpath.strategy import Trajectory


@lock_output("out")
def toolpaths(
    category: Literal["chair", "car", "plane", "table"] | None = None,
    data: Folder | None = None,
    members: NonNegativeCount = 10,
    trajectory: Trajectory = "raster",
    edge_margin_mm: NonNegative = 0.0,
    meshes: tuple[Annotated[Path, Metavar("FOLDER")], ...] = (),
    planner: tuple[Annotated[str, Metavar("PLANNER")], ...] = ("auto",),
    surface: Literal["mesh", "votes", "scan"] = "mesh",
    sample: Count | None = None,
    out: Folder | None = None,
    overwrite: bool = False,
) -> None:
    """Tool paths planned on known regions, measured.

    Objects of 0.9 m, a tool radius of 25 mm, a stepover of 25 mm: on every region of members that
    no training set holds and, with --data, of the Benchmark for Surface Region Correspondence.
    Apart from all regions, those that the tool's footprint fits into.

    With --meshes, on real meshes instead, and every figure is measured on the mesh that was given,
    beside the bar that it is held to. A folder with labels.json holds labelled furniture, scaled to
    0.9 m; one named car holds cars of 4.5 m, on whose bonnet, roof and door is planned; one named
    plane aircraft of 4.5 m, on whose right wing is planned; any other mesh is one region, of
    1.05 m. With more than one planner, they are shown side by side. Interrupted, the same command
    goes on. docs/evidence/toolpaths.md defines the figures.

    Example: nrdf eval toolpaths --category chair --data bsrc/

    Or: nrdf eval toolpaths --meshes objects/ikea shapes/car --planner auto plane-slices --out out/

    Args:
        category: chair, car, plane or table; or give --meshes.
        data: BSRC's folder, with Chair, Car and plane in it.
        members: Members of the parametric family.
        trajectory: A planner's name in nrdf.toolpath.planners; not for --meshes.
        edge_margin_mm: Margin along the regions' borders; not for --meshes.
        meshes: Folders of meshes, or mesh files.
        planner: With --meshes, one or more: "auto", rods for legs, rails and armrests and rasters
            for all else; or a planner's name in nrdf.toolpath.planners.
        surface: What is planned on: the mesh with its own faces as
            regions; "votes": the mesh, regions by votes of points as in retrieval; "scan": a mesh
            made of a simulated scan of three views, 200,000 points with noise of 1 mm.
        sample: Only so many meshes of each folder, evenly chosen.
        out: Folder for the results on meshes: tables, a row a region as CSV and JSON, and a picture
            of each mesh with its paths in pictures/.
        overwrite: Start anew, whatever is in the folder.
    """
    if meshes:
        _on_meshes(meshes, planner, surface, sample, out, overwrite)
        return
    if category is None:
        from nrdf.errors import DataError

        raise DataError("give --category chair, car, plane or table, or --meshes FOLDER")
    from dataclasses import replace

    import numpy as np

    from nrdf_benchmark.toolpaths import (
        STRATEGY,
        bsrc_objects,
        evaluate_toolpaths,
        family_members,
        summarize,
    )

    strategy = replace(STRATEGY, trajectory=trajectory, edge_margin_m=edge_margin_mm / 1e3)
    sources = {"families": family_members(category, members)}
    if data is not None:
        sources["BSRC"] = bsrc_objects(data, category)
    for source, objects in sources.items():
        with progress_bar(f"{category}s, {source}") as progress:
            results = evaluate_toolpaths(objects, strategy, lambda n: progress(n, n))
        for what, chosen in (
            ("all regions", results),
            ("those that the footprint fits into", [r for r in results if r.wide]),
        ):
            title = f"\n{category}, {source}, {trajectory}: {what}, {len(chosen)}"
            shown = table(title, "", "bar", "met by", "median", "worst")
            for metric in summarize(chosen, strategy):
                cells = (np.median(metric.values), metric.worst)
                met = f"{metric.met.mean():.0%}" if metric.bar else ""
                shown.add_row(metric.name, metric.bar, met, *(f"{cell:.2f}" for cell in cells))
            show(shown)
        seconds = 8.0 * float(np.mean([r.seconds for r in results]))
        console.print(f"planning takes {seconds:.2f} s of CPU time for 8 regions")


def _on_meshes(
    meshes: tuple[Path, ...],
    planners: tuple[str, ...],
    surface: Literal["mesh", "votes", "scan"],
    sample: int | None,
    out: Path | None,
    overwrite: bool,
) -> None:
    from nrdf_benchmark.mesh_paths.evaluate import MeshPathResult, evaluate_mesh_paths
    from nrdf_benchmark.mesh_paths.table import (
        HEADINGS,
        comparison,
        mesh_rows,
        selections,
        totals,
        write_comparison,
        write_results,
    )
    from nrdf_benchmark.mesh_paths.targets import target_sources
    from nrdf_benchmark.result_cache import LineCache

    sources = target_sources(meshes, sample)
    cache = None if out is None else LineCache(out, overwrite)
    by_planner: dict[str, list[MeshPathResult]] = {}
    written = []
    for planner in dict.fromkeys(planners):
        pictures = None if out is None else out / "pictures" / f"{planner}-{surface}"
        if pictures is not None:
            pictures.mkdir(parents=True, exist_ok=True)
        with progress_bar(f"meshes, {planner}") as progress:
            results = evaluate_mesh_paths(sources, planner, cache, progress, surface, pictures)
        by_planner[planner] = results
        title = f"Tool paths on {len(sources)} meshes, planner {planner}"
        if surface != "mesh":
            title += f", on {surface}"
        for what, chosen in selections(results):
            shown = table(f"\n{title}: {what}, {len(chosen)}", "", *HEADINGS)
            for row in mesh_rows(chosen):
                shown.add_row(row.name, *row.cells)
            show(shown)
        console.print(totals(results))
        for result in results:
            if result.error:
                console.print(f"{result.target}, {result.region}: no path: {result.error}")
        if out is not None:
            from nrdf.training.provenance import git_commit

            origin = {"command": command_line(), "versions": versions(), "commit": git_commit()}
            written += write_results(out, f"{planner}-{surface}", results, title, origin)
    if len(by_planner) > 1:
        for what, rows in comparison(by_planner):
            shown = table(f"\n{what}: met by; median; worst", "", "bar", *by_planner)
            for cells in rows:
                shown.add_row(*cells)
            show(shown)
        if out is not None:
            written.append(write_comparison(out, by_planner))
    if written:
        console.print("wrote " + ", ".join(str(path) for path in written))
