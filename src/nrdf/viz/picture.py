"""Pictures of clouds and meshes with their regions and the lines on them, for a person to look at.

A mesh with its regions and tool paths:

    panel = Panel.of_mesh("chair", target, {"seat": seat.mesh}, lines={"seat": strokes})
    draw_regions([panel], "picture.png", size=900)
    close = render_details(panel, ["seat"], size=600)  # each region from its own side
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from nrdf.geometry.canonical import canonical_transform
from nrdf.geometry.mesh import Mesh
from nrdf.geometry.normals import estimate_normals
from nrdf.geometry.sampling import downsample
from nrdf.viz.mesh_render import MeshScene, Triangles
from nrdf.viz.palette import DEEP, NO_REGION, PALE, region_colours
from nrdf.viz.render import Scene, SurfaceLines
from nrdf.viz.sheet import GREY, Sheet, legend_height
from nrdf.viz.view import FRONT, Camera

_MAX_POINTS = 20_000
_MARGIN = 0.05  # canonical, around each object


OTHER_SIDES = (
    Camera(0.65 + np.pi, 0.38),
    Camera(0.65, -0.45),
    Camera(0.65 + np.pi, -0.45),
)
"""Where to look from when a region cannot be seen from the front."""


@dataclass(frozen=True)
class Panel:
    """One object in a picture.

    points: (n, 3), any unit, +X forward, +Y up; normals: (n, 3) outward, or None to estimate them;
    regions: name to indices (k,) or boolean mask (n,); note: a line under the title. lines: name of
    a region to lines (k, 3) on it, such as a tool's; its colour is paler then, and theirs deep.
    With `mesh` that is drawn, not the points, and of each region its mesh in `region_meshes`; moves
    are ways (k, 3) through the air. All are in the points' frame and unit.
    """

    title: str
    points: np.ndarray
    normals: np.ndarray | None = None
    regions: Mapping[str, np.ndarray] = field(default_factory=dict)
    note: str = ""
    lines: Mapping[str, Sequence[np.ndarray]] = field(default_factory=dict)
    mesh: Triangles | None = None
    region_meshes: Mapping[str, Triangles] = field(default_factory=dict)
    moves: Sequence[np.ndarray] = ()

    @staticmethod
    def of_mesh(
        title: str,
        mesh: Triangles,
        regions: Mapping[str, Triangles] | None = None,
        lines: Mapping[str, Sequence[np.ndarray]] | None = None,
        moves: Sequence[np.ndarray] = (),
        note: str = "",
    ) -> Panel:
        """A mesh, with the meshes of its regions (cut out of it), tool paths on them, and moves.

        What is a mesh has vertices and faces: a `TargetMesh`, a `RegionMesh`'s `mesh`, a `Mesh`. A
        region's lines (k, 3) are contacts of the tool. What other surface hides is not drawn.
        """
        return Panel(
            title, np.asarray(mesh.vertices), note=note, lines=lines or {}, mesh=mesh,
            region_meshes=regions or {}, moves=moves,
        )  # fmt: skip

    @property
    def names(self) -> list[str]:
        """All regions that it shows."""
        return list(dict.fromkeys((*self.regions, *self.region_meshes, *self.lines)))

    @cached_property
    def scene(self) -> Scene | MeshScene:
        """What of it is drawn, made ready once for all its pictures."""
        return _prepare(self, self.names)


def draw_regions(
    panels: Sequence[Panel], path: str | Path, size: int = 420, details: bool = False
) -> None:
    """Write a picture of `panels` side by side, one colour a region; `path`'s ending is its format.

    The same camera is used for all of them, and a second row is added from another side if some
    region could hardly be seen (beside the first for one panel). `size`: width of a panel in
    pixels. details: beside a panel that stands alone, each of its regions from its own side. Takes
    about 0.2 s a panel. Raises OutputError if the file cannot be written.
    """
    rows, colours = render_panels(panels, size)
    if len(panels) == 1:
        close = render_details(panels[0], panels[0].names, size) if details else {}
        rows = [_of_one_height([row[0] for row in rows] + list(close.values()))]
    _compose(rows, panels, colours, Path(path), size)


def render_panels(
    panels: Sequence[Panel], size: int, own: Mapping[str, np.ndarray] | None = None
) -> tuple[list[list[np.ndarray]], dict[str, np.ndarray]]:
    """The pictures that `draw_regions` puts together, and each region's colour.

    One row a view, in it an array (h, size, 3) in [0, 1] for each panel, all of the same scale.
    own: colours (3,) in [0, 1] of regions instead of the usual ones.
    """
    names = list(dict.fromkeys(name for panel in panels for name in panel.names))
    colours = {**region_colours(names), **{n: c for n, c in (own or {}).items() if n in names}}
    drawn = [p.scene if p.names == names else _prepare(p, names) for p in panels]
    hidden = _hidden_regions(drawn, len(names))
    cameras = [FRONT, _best_side(drawn, hidden)] if hidden else [FRONT]
    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        rows = pool.map(lambda camera: _row(drawn, colours, camera, size), cameras)
        return list(rows), colours


def render_details(panel: Panel, names: Sequence[str], size: int) -> dict[str, np.ndarray]:
    """Close pictures (size, size, 3) in [0, 1] of some of a panel's regions, each from its side
    and with its own lines."""
    every = panel.names
    table, pale = _fills(region_colours(every))
    scene = panel.scene

    def draw(name: str) -> np.ndarray:
        own = scene.region == every.index(name)
        if not own.any():
            return np.ones((size, size, 3), np.float32)
        axes = Camera.towards(scene.normals[own].mean(axis=0)).axes()
        view = scene.points @ axes.T
        low, high = view[own].min(axis=0)[:2], view[own].max(axis=0)[:2]
        side = 1.2 * float((high - low).max()) + _MARGIN
        corner = (low + high - side) / 2
        near = ((view[:, :2] > corner - 0.05) & (view[:, :2] < corner + side + 0.05)).all(axis=1)
        colours = pale if scene.lines else table
        drawn = scene.select(near, every.index(name))
        return drawn.render(axes, corner, size / side, (size, size), colours, DEEP * table)[::-1]

    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        return dict(zip(names, pool.map(draw, names), strict=True))


def _fills(colours: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Each region's colour, without and with lines on it, and last that of no region, (r + 1, 3)
    each."""
    table = np.array([*colours.values(), NO_REGION])
    return table, np.array([*(PALE * table[:-1] + (1 - PALE)), NO_REGION])


def _prepare(panel: Panel, names: list[str]) -> Scene | MeshScene:
    return _prepare_cloud(panel, names) if panel.mesh is None else _prepare_mesh(panel, names)


def _prepare_mesh(panel: Panel, names: list[str]) -> MeshScene:
    assert panel.mesh is not None
    centre, scale = canonical_transform(np.asarray(panel.mesh.vertices))

    def moved(mesh: Triangles) -> Mesh:
        return Mesh((np.asarray(mesh.vertices) - centre) / scale, np.asarray(mesh.faces))

    def ways(lines: Sequence[np.ndarray]) -> list[np.ndarray]:
        return [(np.asarray(line) - centre) / scale for line in lines if len(line)]

    regions = [(names.index(name), moved(mesh)) for name, mesh in panel.region_meshes.items()]
    lines = {names.index(name): ways(own) for name, own in panel.lines.items()}
    return MeshScene.of(moved(panel.mesh), regions, lines, ways(panel.moves))


def _prepare_cloud(panel: Panel, names: list[str]) -> Scene:
    points = np.asarray(panel.points, np.float64)
    region = np.full(len(points), -1)
    # Where regions overlap, the one listed last is on top.
    for name, chosen in panel.regions.items():
        region[np.asarray(chosen)] = names.index(name)
    kept = downsample(points, _MAX_POINTS, np.random.default_rng(0))
    centre, scale = canonical_transform(points[kept])
    points = (points[kept] - centre) / scale
    normals = estimate_normals(points) if panel.normals is None else panel.normals[kept]
    distance, near = cKDTree(points).query(points, min(7, len(points)))
    # Smooth shading: normals are averaged where neighbours face the same way.
    alike = np.einsum("ni,nki->nk", normals, normals[near]) > 0.7
    smooth = np.einsum("nk,nki->ni", alike.astype(float), normals[near])
    smooth /= np.maximum(np.linalg.norm(smooth, axis=1, keepdims=True), 1e-12)
    spacing = distance[:, -1] * np.sqrt(np.pi / 6.0)
    typical = float(np.median(spacing))
    radius = np.clip(spacing, 0.6 * typical, 1.4 * typical)
    lines = [
        SurfaceLines(
            names.index(name), tuple((np.asarray(line) - centre) / scale for line in drawn)
        )
        for name, drawn in panel.lines.items()
    ]
    return Scene(points, smooth, region[kept], radius, tuple(lines))


def _row(
    drawn: Sequence[Scene | MeshScene], colours: dict[str, np.ndarray], camera: Camera, size: int
) -> list[np.ndarray]:
    """Pictures (h, size, 3), all of the same height and scale, of prepared clouds."""
    axes = camera.axes()
    corners = [(view.min(0)[:2], view.max(0)[:2]) for view in (c.points @ axes.T for c in drawn)]
    low = np.min([corner[0] for corner in corners], axis=0) - _MARGIN
    high = np.max([corner[1] for corner in corners], axis=0) + _MARGIN
    pixels = size / (high[0] - low[0])
    shape = (int(np.ceil(pixels * (high[1] - low[1]))), size)
    table, pale = _fills(colours)

    def draw(cloud: Scene | MeshScene, corner: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
        first = np.maximum(np.floor((corner[0] - _MARGIN - low) * pixels).astype(int), 0)
        last = np.minimum(np.ceil((corner[1] + _MARGIN - low) * pixels).astype(int), shape[::-1])
        canvas = np.ones((*shape, 3), np.float32)
        canvas[first[1] : last[1], first[0] : last[0]] = cloud.render(
            axes, low + first / pixels, pixels, tuple((last - first)[::-1]),
            pale if cloud.lines else table, DEEP * table,
        )  # fmt: skip
        return canvas[::-1]

    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        return list(pool.map(draw, drawn, corners))


def _hidden_regions(drawn: Sequence[Scene | MeshScene], count: int) -> list[int]:
    """Regions of which less than a quarter of the points can be seen from the front."""
    return [i for i in range(count) if _facing(drawn, i, FRONT) < 0.25]


def _best_side(drawn: Sequence[Scene | MeshScene], hidden: list[int]) -> Camera:
    return max(OTHER_SIDES, key=lambda c: sum(min(_facing(drawn, i, c), 0.4) for i in hidden))


def _facing(drawn: Sequence[Scene | MeshScene], region: int, camera: Camera) -> float:
    """Share of a region's points, over all clouds, that face the camera; 1 if there are none."""
    toward = camera.axes()[2]
    normals = np.concatenate([cloud.normals[cloud.region == region] for cloud in drawn])
    return float((normals @ toward > 0.1).mean()) if len(normals) else 1.0


def _of_one_height(images: list[np.ndarray]) -> list[np.ndarray]:
    """Pictures with white above the lower ones."""
    tall = max(len(image) for image in images)
    return [np.pad(i, ((tall - len(i), 0), (0, 0), (0, 0)), constant_values=1.0) for i in images]


def _compose(
    rows: list[list[np.ndarray]],
    panels: Sequence[Panel],
    colours: dict[str, np.ndarray],
    path: Path,
    size: int,
) -> None:
    """Panels with their titles above and the legend below, written to `path`."""
    header = 62 if any(panel.note for panel in panels) else 40
    width = size * len(rows[0])
    height = header + sum(row[0].shape[0] for row in rows) + legend_height(colours, width)
    sheet = Sheet(width, height)
    for i, panel in enumerate(panels):
        x = (i + 0.5) * width / len(panels)
        sheet.write(panel.title, x, 12, 18, bold=True)
        sheet.write(panel.note, x, 38, 14.5, GREY)
    top = header
    for row in rows:
        for i, image in enumerate(row):
            sheet.paste(image, i * size, top)
        top += row[0].shape[0]
    sheet.add_legend(colours)
    sheet.save(path)
