"""Lines drawn into an image of a surface, only where no surface lies before them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nrdf.geometry.frames import unit_vectors
from nrdf.geometry.polylines import arc_length, even_arc_lengths, interpolate

_ARROW, _ARROWS_APART = 0.012, 0.25  # canonical


@dataclass(frozen=True)
class Canvas:
    """An image (h, w, 3), its lowest row first, and the depth (h, w) before which lines are seen.

    axes: rows right, up, towards the viewer (3, 3). corner (2,): the place of the first pixel's
    corner; pixels: their number per unit length. Radii are in pixels; a share below 1 lets the
    image shine through. Everything is drawn into the image itself.
    """

    image: np.ndarray
    cover: np.ndarray
    axes: np.ndarray
    corner: np.ndarray
    pixels: float

    def lines(
        self,
        lines: Sequence[np.ndarray],
        normals: Sequence[np.ndarray] | None,
        ink: np.ndarray,
        radius: float,
    ) -> None:
        """Lines (k, 3) where they are seen, and their surface's normals (k, 3) face the viewer."""
        shown = [np.zeros((0, 3))]
        for number, points in enumerate(lines):
            along = arc_length(points)
            at = even_arc_lengths(float(along[-1]), 0.5 / self.pixels) if len(points) > 1 else along
            places = interpolate(at, along, points)
            if normals is not None:
                places = places[interpolate(at, along, normals[number]) @ self.axes[2] > 0.0]
            shown.append(places)
        self._dots(np.concatenate(shown), ink, radius, 1.0)

    def arrows(
        self,
        lines: Sequence[np.ndarray],
        normals: Sequence[np.ndarray],
        ink: np.ndarray,
        radius: float,
    ) -> None:
        """Arrow heads along lines that are long enough, which way they are driven."""
        legs = [np.zeros((0, 2, 3))]
        for points, outward in zip(lines, normals, strict=True):
            along = arc_length(points)
            if along[-1] < 5 * _ARROW:
                continue
            at = np.arange(0.5 * min(_ARROWS_APART, along[-1]), along[-1], _ARROWS_APART)
            ahead = interpolate(np.minimum(at + 0.5 * _ARROW, along[-1]), along, points)
            behind = interpolate(np.maximum(at - 0.5 * _ARROW, 0.0), along, points)
            normal = unit_vectors(interpolate(at, along, outward))
            side = 0.4 * np.cross(normal, ahead - behind)
            shown = normal @ self.axes[2] > 0.0
            legs += [np.stack([ahead, behind + sign * side], 1)[shown] for sign in (1.0, -1.0)]
        self.segments(np.concatenate(legs), ink, radius, 1.0)

    def segments(self, ends: np.ndarray, ink: np.ndarray, radius: float, share: float) -> None:
        """Straight pieces (e, 2, 3), where they are seen."""
        if len(ends):
            length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
            count = np.ceil(2.0 * self.pixels * length).astype(np.int64) + 1
            piece, number = counted(count, np.zeros(len(ends), np.int64))
            t = (number / np.maximum(count[piece] - 1, 1))[:, None]
            self._dots((1.0 - t) * ends[piece, 0] + t * ends[piece, 1], ink, radius, share)

    def _dots(self, places: np.ndarray, ink: np.ndarray, radius: float, share: float) -> None:
        view = places @ self.axes.T
        column, row = np.floor((view[:, :2] - self.corner) * self.pixels).astype(int).T
        height, width = self.cover.shape
        inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
        view, column, row = view[inside], column[inside], row[inside]
        seen = view[:, 2] > self.cover[row, column]
        mask = np.zeros(self.cover.shape, bool)
        reach = np.arange(-int(radius), int(radius) + 1)
        middle = np.unique(row[seen] * width + column[seen])
        row, column = np.divmod(middle, width)
        for dy in reach:
            for dx in reach[dy**2 + reach**2 <= radius**2]:
                y, x = np.clip(row + dy, 0, height - 1), np.clip(column + dx, 0, width - 1)
                mask[y, x] = True
        self.image[mask] = (1.0 - share) * self.image[mask] + share * np.asarray(ink, np.float32)


def counted(count: np.ndarray, first: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """For each of `count` (n,): its index, `count` times, beside the numbers from `first` (n,)."""
    index = np.repeat(np.arange(len(count)), count)
    start = np.repeat(np.cumsum(count) - count, count)
    return index, first[index] + np.arange(len(index)) - start
