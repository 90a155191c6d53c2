"""The film or depth that processes leave, in colours on a target, and what the colours mean."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

from nrdf.geometry.mesh import Mesh
from nrdf.process.result_target import result_settings
from nrdf.process.transfer_result import PathResult
from nrdf.reports.result_report import histogram
from nrdf.studio.scene.colours import BARE
from nrdf.studio.scene.object_view import ObjectView
from nrdf.viz.heat_map import COLOURS, level_areas, levels_of

_WIDEST_PX = 120


def draw_result(object_view: ObjectView, steps: Sequence[PathResult]) -> None:
    """Draw what paths leave on an object, whose other surface is then bare."""
    object_view.draw_regions(result_meshes(steps))
    count = len(object_view.paintable.points)
    object_view.set_colours(np.tile(BARE.astype(np.uint8), (count, 1)))


def result_meshes(steps: Sequence[PathResult]) -> dict[str, tuple[Mesh, np.ndarray]]:
    """What paths leave on their regions, of each region's last process with a target: a mesh, m,
    for each colour, with the colour (3,), 0 to 255."""
    drawn: dict[str, tuple[Mesh, np.ndarray]] = {}
    for region, step in _shown(steps).items():
        settings, result = result_settings(step.process), step.result
        assert settings is not None and result is not None  # of those that are shown
        cells, target = result.model.cells, settings.target
        values = cells.of_region(result.model.values())
        levels = levels_of(values, target.value_m, target.tolerance_m)
        for level in np.unique(levels):
            faces = cells.fine.faces[levels == level]
            used, renumbered = np.unique(faces, return_inverse=True)
            mesh = Mesh(cells.fine.vertices[used], renumbered.reshape(-1, 3))
            drawn[f"{region} {level}"] = (mesh, _rgb(COLOURS[level]))
    return drawn


def result_legend(key: str, steps: Sequence[PathResult]) -> str:
    """HTML of a target: each region's share within the tolerance, and how much of it has which
    thickness or depth, µm, in which colour; "" where no process has a target."""
    parts = []
    for region, step in _shown(steps).items():
        settings, result = result_settings(step.process), step.result
        assert settings is not None and result is not None
        cells, target = result.model.cells, settings.target
        shares = level_areas(
            cells.fine, cells.of_region(result.model.values()), target.value_m, target.tolerance_m
        )
        what = "film" if step.process.thickness_um else "depth"
        wanted = f"{1e6 * target.value_m:.4g} ± {1e6 * target.tolerance_m:.4g} µm"
        parts.append(
            f"<p><b>{escape(key)}, {escape(region)}</b>: {result.metrics.within:.1%} has the "
            f"{what} wanted, {wanted}; at one feed {result.taught.within:.1%}</p>"
        )
        parts += [
            f'<div style="display:flex;align-items:center;gap:6px;font-size:12px">'
            f'<span style="width:90px;text-align:right">{name}</span>'
            f'<span style="width:{max(_WIDEST_PX * share, 1):.0f}px;height:11px;'
            f'background:{colour};border:1px solid #8888"></span>{share:.1%}</div>'
            for name, share, colour in histogram(shares, target.value_m, target.tolerance_m)
        ]
    return "".join(parts)


def _shown(steps: Sequence[PathResult]) -> dict[str, PathResult]:
    """Each region's last step that has a result."""
    return {step.region: step for step in steps if step.result is not None}


def _rgb(colour: str) -> np.ndarray:
    return np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)], float)
