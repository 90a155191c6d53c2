"""A picture like the paper's Fig. 5: regions of a reference, found on targets, beside the truth."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from nrdf.viz.picture import Panel, render_panels
from nrdf.viz.sheet import GREY, Sheet, legend_height
from nrdf_benchmark.bsrc.dataset import Benchmark
from nrdf_benchmark.methods.registry import Method
from nrdf_benchmark.metrics import chamfer_l1

TARGETS = 4
_HEADER, _LABELS = 84, 40  # pixels


def draw_comparison(
    benchmark: Benchmark, name: str, match: Method, path: Path, size: int = 300
) -> None:
    """Write a picture of the first object's regions, found by a method on the next `TARGETS`.

    Left the reference with its regions, then a column a target: retrieved regions above, true ones
    below; both again from another side if some region could hardly be seen. size: width of a
    column in pixels. Raises OutputError if the file cannot be written, and what the method raises.
    """
    reference, *others = benchmark.objects
    targets = others[:TARGETS]
    panels = [
        Panel(reference.name, reference.cloud.points, reference.cloud.normals, reference.truth)
    ]
    notes = []
    for target in targets:
        found = match(reference.cloud, reference.regions, target.cloud)
        distances = [
            chamfer_l1(target.cloud.points[found[roi]], target.regions[roi])
            for roi in benchmark.rois
            if len(found[roi])
        ]
        missed = len(benchmark.rois) - len(distances)
        mean = f"CD-L1 {np.mean(distances):.4f}" if distances else ""
        notes.append(mean + f", {missed} not found" * bool(missed))
        panels.append(Panel(target.name, target.cloud.points, target.cloud.normals, found))
    for target in targets:
        panels.append(Panel(target.name, target.cloud.points, target.cloud.normals, target.truth))
    views, colours = render_panels(panels, size)
    shown = panels[: 1 + len(targets)]
    _compose(views, shown, notes, colours, f"{name}, {benchmark.category}", path)


def _compose(
    views: list[list[np.ndarray]],
    panels: list[Panel],
    notes: list[str],
    colours: dict[str, np.ndarray],
    title: str,
    path: Path,
) -> None:
    """Each view as two lines of targets, with the reference half-way between them."""
    heights = [view[0].shape[0] for view in views]
    size, columns = views[0][0].shape[1], len(panels)
    width = columns * size + _LABELS
    sheet = Sheet(width, _HEADER + 2 * sum(heights) + legend_height(colours, width))
    sheet.write(title, width / 2, 10, 19, bold=True)
    heads = ["reference", *notes]
    for column, (panel, note) in enumerate(zip(panels, heads, strict=True)):
        x = column * size + size / 2 + (_LABELS if column else 0)
        sheet.write(panel.title, x, 40, 17, bold=True)
        sheet.write(note, x, 62, 14.5, GREY)
    top = _HEADER
    for view, tall in zip(views, heights, strict=True):
        sheet.paste(view[0], 0, top + tall // 2)
        for line, label in enumerate(("retrieved", "true")):
            for column in range(1, columns):
                image = view[column + line * (columns - 1)]
                sheet.paste(image, _LABELS + column * size, top + line * tall)
            sheet.write_upwards(label, size + _LABELS // 2, int(top + (line + 0.5) * tall), 17)
        top += 2 * tall
    sheet.add_legend(colours)
    sheet.save(path)
