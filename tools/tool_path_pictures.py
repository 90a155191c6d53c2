"""Draw ten jobs on real meshes, one of each kind of part, for docs/evidence/toolpaths.md.

    python tools/tool_path_pictures.py objects/ikea shapes/car shapes/plane

The folders are those of `nrdf eval toolpaths --meshes`, and so are the planners. Writes
docs/images/tool-paths.png.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from nrdf.toolpath.mesh_planner import plan_on_mesh
from nrdf.toolpath.planners import PLANNERS
from nrdf.viz.picture import Panel, render_details, render_panels, write_figure
from nrdf_benchmark.mesh_paths.evaluate import usual_planner
from nrdf_benchmark.mesh_paths.found_surface import regions_on
from nrdf_benchmark.mesh_paths.targets import MeshTarget, target_sources

PICTURE = Path(__file__).resolve().parents[1] / "docs" / "images" / "tool-paths.png"
JOBS = (
    ("table/lunnarp", "leg", False),
    ("chair/klappsta", "arm", False),
    ("chair/stefan", "back", True),
    ("chair/sundvik", "back", True),
    ("chair/agam", "seat", True),
    ("table/falholmen", "top", False),
    ("stool/grubban", "seat", True),
    ("car/torcs-p406", "bonnet", True),
    ("car/gazebo-hatchback", "door", True),
    ("plane/fam-B747", "wing", True),
)
"""Object, part, and whether it is seen from close by, from its own side."""
PIXELS, COLUMNS, HEADING = 460, 5, 34


def main() -> None:
    sources = {source.name: source for source in target_sources([Path(p) for p in sys.argv[1:]])}
    pictures = [drawn(sources[name].read(), part, close) for name, part, close in JOBS]
    rows = -(-len(JOBS) // COLUMNS)
    width, height = COLUMNS * PIXELS, rows * (PIXELS + HEADING)
    figure = Figure((width / 100, height / 100), dpi=100, facecolor="white")
    FigureCanvasAgg(figure)
    for k, ((name, part, _), image) in enumerate(zip(JOBS, pictures, strict=True)):
        row, column = divmod(k, COLUMNS)
        top = height - row * (PIXELS + HEADING)
        title = f"{part}, {name.split('/')[1]}: {usual_planner(part)}"
        x, y = (column + 0.5) / COLUMNS, (top - 9) / height
        figure.text(x, y, title, ha="center", va="top", size=12, color="#222")
        pixels = (255 * image[-PIXELS:]).astype(np.uint8)
        figure.figimage(pixels, xo=column * PIXELS, yo=top - HEADING - len(pixels))
    write_figure(figure, PICTURE, 100)


def drawn(target: MeshTarget, part: str, close: bool) -> np.ndarray:
    """A picture (h, PIXELS, 3) in [0, 1] of the paths on one part."""
    region = regions_on(target, "mesh")(part)
    segments = plan_on_mesh(region, target.strategy, PLANNERS[usual_planner(part)])
    off = target.strategy.standoff_m
    lines = [s.positions + off * s.axes for s in segments if s.kind == "process"]
    panel = Panel.of_mesh(target.name, region.parent, {part: region.mesh}, {part: lines})
    if close:
        return render_details(panel, [part], PIXELS)[part]
    return render_panels([panel], PIXELS)[0][0][0]


if __name__ == "__main__":
    main()
