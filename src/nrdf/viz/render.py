"""A point cloud drawn as small shaded discs that lie in the surface, nearest on top.

What faces away is left out. The pinholes between discs are closed in the depth image, edges are
set off by depth (eye-dome lighting: Boucheny 2009), and the whole is drawn twice as large and
reduced. Lines on the surface are drawn where nothing lies before them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from nrdf.geometry.polylines import resample
from nrdf.viz.view import OVERSAMPLING, eye_dome, reduced

_LINE, _DOT = 1.6, 5.0  # radius of a line, and of the dot at its beginning, in fine pixels
_SUNK = 0.015  # canonical depth by which a line may lie in the surface and still be drawn on it


@dataclass(frozen=True)
class SurfaceLines:
    """Lines (k, 3), canonical, of one region's number."""

    region: int
    lines: tuple[np.ndarray, ...]


@dataclass(frozen=True)
class Scene:
    """A cloud ready to draw: canonical points, normals (n, 3), region (n,), -1 for none, the
    radius (n,) of each disc, and lines on it."""

    points: np.ndarray
    normals: np.ndarray
    region: np.ndarray
    radius: np.ndarray
    lines: tuple[SurfaceLines, ...] = ()

    def select(self, mask: np.ndarray, region: int) -> Scene:
        """Only the points of a mask (n,), and the lines of one region's number."""
        kept = (self.points[mask], self.normals[mask], self.region[mask], self.radius[mask])
        return Scene(*kept, tuple(lines for lines in self.lines if lines.region == region))

    def render(
        self,
        axes: np.ndarray,
        corner: np.ndarray,
        pixels: float,
        shape: tuple[int, int],
        table: np.ndarray,
        line_colours: np.ndarray,
    ) -> np.ndarray:
        """The cloud on white, (h, w, 3) in [0, 1] with the lowest row first, h and w by `shape`.

        axes: rows right, up, towards the viewer (3, 3). `corner` (2,) is the place of the first
        pixel's corner, `pixels` their number per unit length. table: a colour for each region, the
        last for none; line_colours: the same for lines.
        """
        shape, pixels = (OVERSAMPLING * shape[0], OVERSAMPLING * shape[1]), OVERSAMPLING * pixels
        front = np.flatnonzero(self.normals @ axes[2] > 0.0)
        owner, depth = _splat(self, front, axes, corner, pixels, shape)
        spacing = float(np.median(self.radius)) * pixels
        owner, depth = _close_pinholes(owner, depth, int(2.0 * spacing) | 1, 4.0 * spacing / pixels)
        # A little blur of the outline takes off the discs' roundness.
        cover = ndimage.gaussian_filter((owner >= 0).astype(np.float32), 0.35 * spacing)
        painted = (owner >= 0) & (cover > 0.5)

        light = np.array([-0.35, 0.75, 0.6]) @ axes
        lit = self.normals @ (light / np.linalg.norm(light))
        shade = 0.62 + 0.38 * np.clip(0.5 + 0.5 * lit, 0.0, 1.0) ** 1.2
        colour = (table[self.region] * shade[:, None]).astype(np.float32)
        image = np.ones((*shape, 3), np.float32)
        image[painted] = colour[owner[painted]]
        image *= eye_dome(np.where(painted, depth, np.float32(-1.5)), OVERSAMPLING)[..., None]
        for lines in self.lines:
            # A line may dip into its own region, but not shine through a thin part.
            own = (owner >= 0) & (self.region[owner] == lines.region)
            cover = depth - np.where(own, np.float32(_SUNK), np.float32(0.0))
            _paint(image, cover, lines.lines, line_colours[lines.region], axes, corner, pixels)
        return reduced(image)


def _splat(
    cloud: Scene,
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


def _paint(
    image: np.ndarray,
    cover: np.ndarray,
    lines: Sequence[np.ndarray],
    colour: np.ndarray,
    axes: np.ndarray,
    corner: np.ndarray,
    pixels: float,
) -> None:
    """Draw lines (k, 3) into `image` before the depth `cover`, and a dot where they begin."""
    lines = [line for line in lines if len(line)]
    if not lines:
        return
    fine = np.concatenate([resample(line, 0.5 / pixels) for line in lines])
    for points, radius in ((fine, _LINE), (lines[0][:1], _DOT)):
        view = points @ axes.T
        column, row = np.floor((view[:, :2] - corner) * pixels).astype(int).T
        reach = np.arange(-int(radius), int(radius) + 1)
        dx, dy = (grid.ravel() for grid in np.meshgrid(reach, reach))
        dx, dy = dx[dx**2 + dy**2 <= radius**2], dy[dx**2 + dy**2 <= radius**2]
        x, y = column[:, None] + dx, row[:, None] + dy
        inside = (x >= 0) & (x < image.shape[1]) & (y >= 0) & (y < image.shape[0])
        which, at = np.nonzero(inside)
        x, y = x[which, at], y[which, at]
        seen = view[which, 2] > cover[y, x]
        image[y[seen], x[seen]] = colour


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
