"""A picture like the paper's Fig. 5: regions of a reference, found on targets, beside the truth."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from nrdf.viz.picture import Panel, add_legend, render_panels, write_figure
from nrdf_benchmark.bsrc.dataset import Benchmark
from nrdf_benchmark.methods.registry import Method
from nrdf_benchmark.metrics import chamfer_l1

TARGETS = 4
_DPI = 100
_HEADER, _FOOTER, _LABELS = 84, 50, 40  # pixels
_TEXT: dict[str, Any] = {"ha": "center", "family": "DejaVu Sans"}


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
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    heights = [view[0].shape[0] for view in views]
    size, columns = views[0][0].shape[1], len(panels)
    width = columns * size + _LABELS
    height = _HEADER + _FOOTER + 2 * sum(heights)
    figure = Figure((width / _DPI, height / _DPI), dpi=_DPI, facecolor="white")
    FigureCanvasAgg(figure)

    def put(image: np.ndarray, x: int, top: int) -> None:
        figure.figimage((image * 255).astype(np.uint8), xo=x, yo=top - image.shape[0])

    def write(text: str, x: float, y: float, **style: Any) -> None:
        figure.text(x / width, y / height, text, **_TEXT, **style)

    write(title, width / 2, height - 26, size=14, weight="bold", color="#222")
    heads = ["reference", *notes]
    for column, (panel, note) in enumerate(zip(panels, heads, strict=True)):
        x = column * size + size / 2 + (_LABELS if column else 0)
        write(panel.title, x, height - 54, size=12, weight="bold", color="#222")
        write(note, x, height - 74, size=10.5, color="#666")
    top = height - _HEADER
    for view, tall in zip(views, heights, strict=True):
        put(view[0], 0, top - tall // 2)
        for line, label in enumerate(("retrieved", "true")):
            for column in range(1, columns):
                image = view[column + line * (columns - 1)]
                put(image, _LABELS + column * size, top - line * tall)
            style = {"rotation": 90, "va": "center", "size": 12, "color": "#444"}
            write(label, size + _LABELS / 2, top - (line + 0.5) * tall, **style)
        top -= 2 * tall
    add_legend(figure, colours)
    write_figure(figure, path, _DPI)
