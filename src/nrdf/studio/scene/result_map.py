"""The film or depth that processes leave, in colours on a target, and what the colours mean."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

from nrdf.geometry.mesh import Mesh
from nrdf.reports.result_report import histogram
from nrdf.studio.model.computed import LeftResult
from nrdf.studio.scene.colours import BARE
from nrdf.studio.scene.object_view import ObjectView
from nrdf.viz.heat_map import COLOURS, level_areas

_WIDEST_PX = 120


def draw_result(object_view: ObjectView, left: Sequence[LeftResult]) -> None:
    """Draw what paths leave on an object, whose other surface is then bare."""
    object_view.draw_regions(result_meshes(left))
    count = len(object_view.paintable.points)
    object_view.set_colours(np.tile(BARE.astype(np.uint8), (count, 1)))


def result_meshes(left: Sequence[LeftResult]) -> dict[str, tuple[Mesh, np.ndarray]]:
    """What paths leave on regions: a mesh, m, for each colour, with the colour (3,), 0 to 255."""
    return {
        f"{one.region} {level}": (mesh, _rgb(COLOURS[level]))
        for one in left
        for level, mesh in one.level_meshes.items()
    }


def result_legend(key: str, left: Sequence[LeftResult]) -> str:
    """HTML of an object: each region's share within the tolerance, and how much of it has which
    thickness or depth, µm, in which colour; "" where no process has a target."""
    parts = []
    for one in left:
        shares = level_areas(one.mesh, one.values, one.target_m, one.tolerance_m)
        wanted = f"{1e6 * one.target_m:.4g} ± {1e6 * one.tolerance_m:.4g} µm"
        parts.append(
            f"<p><b>{escape(key)}, {escape(one.region)}</b>: {one.within:.1%} has the "
            f"{one.what} wanted, {wanted}; at one feed {one.at_one_feed:.1%}</p>"
        )
        parts += [
            f'<div style="display:flex;align-items:center;gap:6px;font-size:12px">'
            f'<span style="width:90px;text-align:right">{name}</span>'
            f'<span style="width:{max(_WIDEST_PX * share, 1):.0f}px;height:11px;'
            f'background:{colour};border:1px solid #8888"></span>{share:.1%}</div>'
            for name, share, colour in histogram(shares, one.target_m, one.tolerance_m)
        ]
    return "".join(parts)


def _rgb(colour: str) -> np.ndarray:
    return np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)], float)
