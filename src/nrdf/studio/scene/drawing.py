"""What is drawn of an object: the colours of its points, its lines, its label, its arrow."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from nrdf.reports.job_folder import lines_of_paths
from nrdf.studio.model.document import REFERENCE
from nrdf.studio.model.editor import Editor
from nrdf.studio.model.placing import removed_points
from nrdf.studio.model.result_cache import ResultCache
from nrdf.studio.scene.colours import confidence_colours, painted_colours
from nrdf.viz.mesh_render import Triangles

_MOST_REMOVED = 20_000
_DEEP, _PALE = 0.5, 0.62
"""Shares of a region's colour in the lines on it, and in the region where found are lines."""


def found_indices(results: ResultCache, key: str, region: str) -> np.ndarray | None:
    """Indices (k,) of a target's points that were found to be in a region, None for none."""
    result = results.by_target.get(key)
    if result is None or region not in result.transfer_result.regions:
        return None
    region_there = result.transfer_result.regions[region]
    return None if region_there.missing else region_there.match.indices


def region_meshes_of(
    editor: Editor, results: ResultCache, key: str
) -> dict[str, tuple[Triangles, np.ndarray]]:
    """The meshes of an object's regions as they are planned on: name to (mesh, m; colour (3,)), on
    a target paler where the confidence is lower. Regions that a person has corrected, or that are
    not planned, have none: they are painted."""
    result, target = results.by_target.get(key), editor.target(key)
    if key == REFERENCE:
        return {
            region.name: (mesh, np.array(_pale(region.colour)))
            for region in editor.document.regions
            if (mesh := results.shown_mesh(region)) is not None
        }
    if result is None or target is None:
        return {}
    drawn: dict[str, tuple[Triangles, np.ndarray]] = {}
    for region in editor.document.regions:
        found = result.transfer_result.regions.get(region.name)
        if found is None or found.mesh is None or region.name in target.corrected:
            continue
        strength = 0.2 + 0.8 * found.match.score
        colour = strength * np.array(_pale(region.colour)) + (1.0 - strength) * 255.0
        drawn[region.name] = (found.mesh.mesh, colour)
    return drawn


def colours_of(
    editor: Editor,
    results: ResultCache,
    key: str,
    by_confidence: bool = False,
    without: Collection[str] = (),
) -> np.ndarray:
    """Colours (k, 3) uint8 of an object's shown points by their regions, some left out.

    On a target they are paler where the confidence is lower; `by_confidence` shows it alone.
    """
    paintable, target = editor.paintable(key), editor.target(key)
    drawn: list[tuple[tuple[int, int, int], np.ndarray, np.ndarray | None]] = []
    for region in editor.document.regions:
        if region.name in without:
            continue
        found = found_indices(results, key, region.name)
        corrected = target is not None and region.name in target.corrected
        confidence = None
        if target is not None and not corrected:
            if found is None:
                continue
            match = results.by_target[key].transfer_result.regions[region.name].match
            everywhere = np.zeros(len(paintable.cloud))
            everywhere[found] = match.confidence
            confidence = paintable.to_shown(everywhere)
        indices = np.flatnonzero(editor.mask(key, region.name, found))
        own = None if confidence is None else confidence[indices]
        drawn.append((region.colour, indices, own))
    count = len(paintable.points)
    if by_confidence and target is not None:
        sure = [(i, np.ones(len(i)) if c is None else c) for _, i, c in drawn]
        return confidence_colours(count, sure)
    return painted_colours(count, [(_pale(c), i, s) for c, i, s in drawn])


def lines_of(
    editor: Editor, results: ResultCache, key: str
) -> dict[str, tuple[Sequence[np.ndarray], np.ndarray]]:
    """The lines on an object's regions: name to (points, each (m, 3), m; colour (3,))."""
    colours = {r.name: _DEEP * np.array(r.colour) for r in editor.document.regions}
    if key != REFERENCE:
        result = results.by_target.get(key)
        drawn = {} if result is None else lines_of_paths(result.transfer_result)
        return {name: (parts, colours[name]) for name, parts in drawn.items() if name in colours}
    lines: dict[str, tuple[Sequence[np.ndarray], np.ndarray]] = {}
    for region in editor.document.regions:
        parts = results.planned_lines(region)
        if parts:
            lines[region.name] = (parts, colours[region.name])
    return lines


def title_of(editor: Editor, results: ResultCache, key: str) -> str:
    """The label of an object: its name, and the regions that a person should check."""
    if key == REFERENCE:
        reference = editor.document.reference
        name = "" if reference is None else reference.name
        return name if name in ("", REFERENCE) else f"{name} (reference)"
    result = results.by_target.get(key)
    if result is None or not result.uncertain_regions:
        return key
    return f"{key}: check {', '.join(result.uncertain_regions)}"


def doubts_of(editor: Editor, key: str) -> tuple[bool, np.ndarray]:
    """Whether nobody has confirmed yet how an object stands, and the points (k, 3), m, that are
    shown until then: those that cleaning removed, thinned."""
    target = editor.target(key)
    placement = None if target is None else target.object.placement
    if target is None or placement is None or placement.confirmed:
        return False, np.zeros((0, 3))
    scan = target.object.scan
    removed = np.zeros((0, 3)) if scan is None else removed_points(scan.cloud, target.object.cloud)
    return True, removed[:: 1 + len(removed) // _MOST_REMOVED]


def about_point(editor: Editor, results: ResultCache, key: str, index: int) -> str:
    """Where a shown point of an object is, mm, and of which regions, in Markdown."""
    paintable = editor.paintable(key)
    x, y, z = 1e3 * paintable.points[index]
    names = []
    for region in editor.document.regions:
        found = found_indices(results, key, region.name)
        if not editor.mask(key, region.name, found)[index]:
            continue
        target = editor.target(key)
        sure = ""
        if found is not None and target is not None and region.name not in target.corrected:
            match = results.by_target[key].transfer_result.regions[region.name].match
            own = match.confidence[np.asarray(found) == paintable.shown[index]]
            sure = f" (confidence {float(own[0]):.2f})" if len(own) else ""
        names.append(f"**{region.name}**{sure}")
    where = ", ".join(names) or "no region"
    return f"{key}: {where}, x {x:.1f}, y {y:.1f}, z {z:.1f} mm"


def direction_of(editor: Editor, region: str, step: int) -> tuple[np.ndarray, np.ndarray] | None:
    """Ends, each (3,), m, of the arrow along a step's lines on the reference, None for no arrow."""
    painted = editor.document.region(region)
    if painted is None or not painted.mask.any():
        return None
    direction = painted.steps[step].get("direction")
    if direction is None or not np.linalg.norm(direction) > 0:
        return None
    paintable = editor.paintable(REFERENCE)
    points = paintable.points[painted.mask]
    middle = points[np.argmin(np.linalg.norm(points - points.mean(axis=0), axis=1))]
    along = np.asarray(direction, np.float64) / np.linalg.norm(direction)
    half = 0.1 * float((paintable.high - paintable.low).max()) * along
    return middle - half, middle + half


def _pale(colour: tuple[int, int, int]) -> tuple[int, int, int]:
    r, g, b = (round(_PALE * c + (1 - _PALE) * 255) for c in colour)
    return (r, g, b)
