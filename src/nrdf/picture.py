"""Pictures of point clouds with their regions, for a person to look at.

Points are drawn as small shaded discs that lie in the surface, nearest on top; what faces away is
left out. The pinholes between discs are closed in the depth image, edges are set off by depth
(eye-dome lighting: Boucheny 2009), and the whole is drawn twice as large and reduced.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from nrdf.errors import OutputError
from nrdf.geometry import canonical_transform, estimate_normals, thin

if TYPE_CHECKING:
    from matplotlib.figure import Figure

log = logging.getLogger(__name__)

BASE_COLOUR = (0.80, 0.81, 0.83)
PALETTE = (
    "#E69F00", "#0072B2", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#F0E442",
    "#882255", "#44AA99", "#999933", "#332288", "#AA4499",
)  # fmt: skip
"""Okabe and Ito's colours for the colour-blind, then those of Tol's "muted" that differ most."""
MOST_POINTS = 20_000
_OVERSAMPLING = 2
_MARGIN = 0.05  # canonical, around each object


@dataclass(frozen=True)
class Camera:
    """Orthographic view: `azimuth` (rad) about +Y from +X towards +Z, `elevation` (rad)."""

    azimuth: float
    elevation: float

    def axes(self) -> np.ndarray:
        """Rows right, up, towards the viewer, each a unit vector: (3, 3)."""
        a, e = self.azimuth, self.elevation
        toward = np.array([np.cos(e) * np.cos(a), np.sin(e), np.cos(e) * np.sin(a)])
        right = np.array([np.sin(a), 0.0, -np.cos(a)])
        return np.stack([right, np.cross(toward, right), toward])


FRONT = Camera(0.65, 0.38)
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
    regions: name to indices (k,) or boolean mask (n,); note: a line under the title.
    """

    title: str
    points: np.ndarray
    normals: np.ndarray | None = None
    regions: Mapping[str, np.ndarray] = field(default_factory=dict)
    note: str = ""


def region_colours(names: Sequence[str]) -> dict[str, np.ndarray]:
    """One colour (3,) in [0, 1] for each region name, in order; repeats after twelve."""
    values = [[int(c[i : i + 2], 16) / 255 for i in (1, 3, 5)] for c in PALETTE]
    return {name: np.array(values[i % len(values)]) for i, name in enumerate(names)}


def draw_regions(panels: Sequence[Panel], path: str | Path, size: int = 420) -> None:
    """Write a picture of `panels` side by side, one colour a region; `path`'s ending is its format.

    The same camera is used for all of them, and a second row is added from another side if some
    region could hardly be seen. `size`: width of a panel in pixels. Takes about 0.2 s a panel.
    Raises OutputError if the file cannot be written.
    """
    rows, colours = render_panels(panels, size)
    _compose(rows, panels, colours, Path(path), size)


def render_panels(
    panels: Sequence[Panel], size: int
) -> tuple[list[list[np.ndarray]], dict[str, np.ndarray]]:
    """The pictures that `draw_regions` puts together, and each region's colour.

    One row a view, in it an array (h, size, 3) in [0, 1] for each panel, all of the same scale.
    """
    names = list(dict.fromkeys(name for panel in panels for name in panel.regions))
    colours = region_colours(names)
    drawn = [_prepare(panel, names) for panel in panels]
    rows = [_row(drawn, colours, FRONT, size)]
    hidden = _hidden_regions(drawn, len(names))
    if hidden:
        rows.append(_row(drawn, colours, _best_side(drawn, hidden), size))
    return rows, colours


@dataclass(frozen=True)
class _Prepared:
    """A panel ready to draw: canonical points, normals (n, 3), region (n,), -1 for none, and the
    radius (n,) of each disc."""

    points: np.ndarray
    normals: np.ndarray
    region: np.ndarray
    radius: np.ndarray


def _prepare(panel: Panel, names: list[str]) -> _Prepared:
    points = np.asarray(panel.points, np.float64)
    region = np.full(len(points), -1)
    # Where regions overlap, the one listed last is on top.
    for name, chosen in panel.regions.items():
        region[np.asarray(chosen)] = names.index(name)
    kept = thin(points, MOST_POINTS, np.random.default_rng(0))
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
    return _Prepared(points, smooth, region[kept], np.clip(spacing, 0.6 * typical, 1.4 * typical))


def _row(
    drawn: list[_Prepared], colours: dict[str, np.ndarray], camera: Camera, size: int
) -> list[np.ndarray]:
    """Pictures (h, size, 3), all of the same height and scale, of prepared clouds."""
    axes = camera.axes()
    corners = [(view.min(0)[:2], view.max(0)[:2]) for view in (c.points @ axes.T for c in drawn)]
    low = np.min([corner[0] for corner in corners], axis=0) - _MARGIN
    high = np.max([corner[1] for corner in corners], axis=0) + _MARGIN
    pixels = size / (high[0] - low[0])
    shape = (int(np.ceil(pixels * (high[1] - low[1]))), size)
    table = np.array([*colours.values(), BASE_COLOUR])

    def draw(cloud: _Prepared, corner: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
        first = np.maximum(np.floor((corner[0] - _MARGIN - low) * pixels).astype(int), 0)
        last = np.minimum(np.ceil((corner[1] + _MARGIN - low) * pixels).astype(int), shape[::-1])
        canvas = np.ones((*shape, 3), np.float32)
        canvas[first[1] : last[1], first[0] : last[0]] = _render(
            cloud, axes, low + first / pixels, pixels, tuple((last - first)[::-1]), table
        )
        return canvas[::-1]

    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        return list(pool.map(draw, drawn, corners))


def _render(
    cloud: _Prepared,
    axes: np.ndarray,
    corner: np.ndarray,
    pixels: float,
    shape: tuple[int, int],
    table: np.ndarray,
) -> np.ndarray:
    """One cloud on white, (h, w, 3) in [0, 1] with the lowest row first, h and w by `shape`.

    `corner` (2,) is the place of the first pixel's corner, `pixels` their number per unit length.
    """
    shape, pixels = (_OVERSAMPLING * shape[0], _OVERSAMPLING * shape[1]), _OVERSAMPLING * pixels
    front = np.flatnonzero(cloud.normals @ axes[2] > 0.0)
    owner, depth = _splat(cloud, front, axes, corner, pixels, shape)
    spacing = float(np.median(cloud.radius)) * pixels
    owner, depth = _close_pinholes(owner, depth, int(2.0 * spacing) | 1, 4.0 * spacing / pixels)
    # A little blur of the outline takes off the discs' roundness.
    cover = ndimage.gaussian_filter((owner >= 0).astype(np.float32), 0.35 * spacing)
    painted = (owner >= 0) & (cover > 0.5)

    light = np.array([-0.35, 0.75, 0.6]) @ axes
    lit = cloud.normals @ (light / np.linalg.norm(light))
    shade = 0.62 + 0.38 * np.clip(0.5 + 0.5 * lit, 0.0, 1.0) ** 1.2
    colour = (table[cloud.region] * shade[:, None]).astype(np.float32)
    image = np.ones((*shape, 3), np.float32)
    image[painted] = colour[owner[painted]]
    image *= _eye_dome(np.where(painted, depth, np.float32(-1.5)), _OVERSAMPLING)[..., None]
    steps = range(_OVERSAMPLING)
    parts = [image[i::_OVERSAMPLING, j::_OVERSAMPLING] for i in steps for j in steps]
    return np.clip(np.add.reduce(parts) / np.float32(len(parts)), 0.0, 1.0)


def _splat(
    cloud: _Prepared,
    chosen: np.ndarray,
    axes: np.ndarray,
    corner: np.ndarray,
    pixels: float,
    shape: tuple[int, int],
) -> tuple[np.ndarray, np.ndarray]:
    """Index of the point seen at each pixel, -1 for none, and its depth, both `shape`."""
    view = (cloud.points[chosen] @ axes.T).astype(np.float32)
    normal = (cloud.normals[chosen] @ axes.T).astype(np.float32)
    x, y = ((view[:, :2] - corner.astype(np.float32)) * np.float32(pixels)).T
    radius = (0.7 * pixels * cloud.radius[chosen]).astype(np.float32)
    slope = -normal[:, :2] / np.maximum(normal[:, 2:], 0.35)
    reach = int(np.ceil(radius.max()))
    offset = np.arange(-reach, reach + 1)
    dx, dy = (grid.ravel() for grid in np.meshgrid(offset, offset))
    owner = np.full(shape[0] * shape[1], -1)
    nearness = np.full(shape[0] * shape[1], -np.inf, np.float32)
    depth = np.full(shape[0] * shape[1], -np.inf, np.float32)
    for start in range(0, len(chosen), 512):
        part = slice(start, start + 512)
        column, row = np.floor(x[part]).astype(np.int32), np.floor(y[part]).astype(np.int32)
        ex = (dx + (column + np.float32(0.5) - x[part])[:, None]).astype(np.float32)
        ey = (dy + (row + np.float32(0.5) - y[part])[:, None]).astype(np.float32)
        # The disc's plane gives each pixel its depth and its distance from the disc's centre.
        rise = slope[part, :1] * ex + slope[part, 1:] * ey
        squared = ex * ex + ey * ey + rise * rise
        which, at = np.nonzero(squared <= radius[part, None] ** 2)
        px, py = column[which] + dx[at], row[which] + dy[at]
        inside = (px >= 0) & (px < shape[1]) & (py >= 0) & (py < shape[0])
        which, at, pixel = which[inside], at[inside], (py * shape[1] + px)[inside]
        z = view[part, 2][which] + rise[which, at] / np.float32(pixels)
        # Of discs in one surface, the one whose centre is nearest wins: cones instead of discs.
        near = z - np.float32(1.0 / pixels) * np.sqrt(squared[which, at])
        np.maximum.at(nearness, pixel, near)
        wins = near == nearness[pixel]
        owner[pixel[wins]], depth[pixel[wins]] = chosen[part][which[wins]], z[wins]
    return owner.reshape(shape), depth.reshape(shape)


def _close_pinholes(
    owner: np.ndarray, depth: np.ndarray, width: int, tolerance: float
) -> tuple[np.ndarray, np.ndarray]:
    """Fill gaps narrower than `width` pixels through which something farther is seen."""
    flat = np.where(owner >= 0, depth, np.float32(-10.0))
    closed = ndimage.minimum_filter(ndimage.maximum_filter(flat, width), width)
    hole = closed > flat + tolerance
    if not hole.any() or hole.all():
        return owner, depth
    nearest = ndimage.distance_transform_edt(
        hole | (owner < 0), return_distances=False, return_indices=True
    )
    source = tuple(axis[hole] for axis in nearest)
    owner, depth = owner.copy(), depth.copy()
    owner[hole], depth[hole] = owner[source], closed[hole]
    return owner, depth


def _eye_dome(depth: np.ndarray, reach: int) -> np.ndarray:
    """Factor in (0, 1] that darkens pixels just behind a nearer neighbour."""
    # The background is far behind, but its own pixels stay white.
    background = depth <= -1.5
    total = np.zeros_like(depth)
    for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        for r in (reach, 2 * reach):
            shifted = np.roll(depth, (r * dy, r * dx), axis=(0, 1))
            total += np.clip(shifted - depth - np.float32(0.006), 0.0, np.float32(0.12))
    return np.where(background, 1.0, np.exp(-1.6 * total))


def _hidden_regions(drawn: list[_Prepared], count: int) -> list[int]:
    """Regions of which less than a quarter of the points can be seen from the front."""
    return [i for i in range(count) if _facing(drawn, i, FRONT) < 0.25]


def _best_side(drawn: list[_Prepared], hidden: list[int]) -> Camera:
    return max(OTHER_SIDES, key=lambda c: sum(min(_facing(drawn, i, c), 0.4) for i in hidden))


def _facing(drawn: list[_Prepared], region: int, camera: Camera) -> float:
    """Share of a region's points, over all clouds, that face the camera; 1 if there are none."""
    toward = camera.axes()[2]
    normals = np.concatenate([cloud.normals[cloud.region == region] for cloud in drawn])
    return float((normals @ toward > 0.1).mean()) if len(normals) else 1.0


def _compose(
    rows: list[list[np.ndarray]],
    panels: Sequence[Panel],
    colours: dict[str, np.ndarray],
    path: Path,
    size: int,
) -> None:
    """Panels with their titles above and the legend below, written to `path`."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    dpi = 100
    header = 62 if any(panel.note for panel in panels) else 40
    footer = 50 if colours else 10
    width = size * len(panels)
    height = header + footer + sum(row[0].shape[0] for row in rows)
    figure = Figure((width / dpi, height / dpi), dpi=dpi, facecolor="white")
    FigureCanvasAgg(figure)
    top = height - header
    for i, panel in enumerate(panels):
        x = (i + 0.5) * size / width
        text: dict[str, Any] = {"ha": "center", "va": "top", "family": "DejaVu Sans"}
        figure.text(x, 1 - 12 / height, panel.title, size=13, weight="bold", color="#222", **text)
        figure.text(x, 1 - 38 / height, panel.note, size=10.5, color="#666", **text)
    for row in rows:
        top -= row[0].shape[0]
        for i, image in enumerate(row):
            figure.figimage((image * 255).astype(np.uint8), xo=i * size, yo=top)
    add_legend(figure, colours)
    write_figure(figure, path, dpi)


def add_legend(figure: Figure, colours: Mapping[str, np.ndarray]) -> None:
    """Each region's name beside its colour, along the lower edge of a matplotlib figure."""
    from matplotlib.patches import Patch

    if colours:
        figure.legend(
            handles=[Patch(color=tuple(colour), label=name) for name, colour in colours.items()],
            loc="lower center",
            ncols=max(1, min(len(colours), int(figure.get_figwidth() / 1.5))),
            frameon=False,
            fontsize=11.5,
            handlelength=1.1,
            handleheight=1.1,
        )


def write_figure(figure: Figure, path: Path, dpi: int) -> None:
    """Write a matplotlib figure, whole or not at all. Raises OutputError if it cannot be."""
    temporary = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix or '.png'}")
    try:
        figure.savefig(temporary, dpi=dpi, pil_kwargs={"compress_level": 4})
        os.replace(temporary, path)
    except OSError as error:
        raise OutputError(f"cannot write the picture {path}: {error.strerror or error}") from None
    finally:
        temporary.unlink(missing_ok=True)
