"""Paths before they are segments: in a patch's plane, and as a tool's contacts with the surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nrdf.geometry.frames import unit_vectors
from nrdf.geometry.polylines import even_arc_lengths, interpolate, step_lengths, summed
from nrdf.surface.patch import Patch
from nrdf.surface.surface import Surface

_TOUCHES, _RESTS = 4, 2e-4  # rounds, and the distance (m) at which a contact counts as found
_JUMP = 1.5  # a step that much longer in space than in a patch's plane leads to another sheet


PlanarPath = np.ndarray
"""(m, 2): points in a patch's plane that a tool passes without lifting."""


@dataclass(frozen=True)
class SurfacePath:
    """A path on the surface: contacts (n, 3), m, and smooth outward normals (n, 3), in driving
    order; closed: a loop, whose last contact is its first."""

    contacts: np.ndarray
    normals: np.ndarray
    closed: bool = False

    def reversed(self) -> SurfacePath:
        """The same path from its end to its start."""
        return SurfacePath(self.contacts[::-1], self.normals[::-1], self.closed)


def place_on_surface(
    surface: Surface,
    patch: Patch,
    parts: Sequence[Sequence[PlanarPath]],
    spacing_m: float,
    radius_m: float,
) -> list[list[SurfacePath]]:
    """Planar paths placed on the surface, their contacts evenly spaced: a block of paths a part."""
    paths = [path for part in parts for path in part]
    if not paths:
        return []
    cuts = np.cumsum([len(path) for path in paths])[:-1]
    even = []
    flat = patch.at(np.concatenate(paths))[0]
    for path, way in zip(paths, np.split(flat, cuts), strict=True):
        along = summed(np.minimum(step_lengths(way), _JUMP * step_lengths(path)))
        at = even_arc_lengths(float(along[-1]), spacing_m, nearest=True)
        even.append(interpolate(at, along, path))
    places = np.concatenate(even)
    flat, along = patch.at(places)
    outward = unit_vectors(np.cross(along[:, 0], along[:, 1]))
    contacts, normals, there = find_contacts(surface, flat, outward, patch.spacing, radius_m)
    farthest = 2.0 * spacing_m + 0.5 * patch.spacing
    blocks, first = [], 0
    ends = iter(np.cumsum([len(line) for line in even]))
    for part in parts:
        block = []
        for _ in part:
            last = int(next(ends))
            found = first + np.flatnonzero(there[first:last])
            # A waypoint that is missing alone is no gap; a step too far is.
            step = step_lengths(contacts[found])
            runs = np.split(found, np.flatnonzero(step > farthest) + 1)
            block += [SurfacePath(contacts[run], normals[run]) for run in runs if len(run) > 1]
            first = last
        if block:
            blocks.append(block)
    return blocks


def find_contacts(
    surface: Surface, flat: np.ndarray, outward: np.ndarray, near: float, radius_m: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The contact (n, 3) of a tool with the surface at places (n, 3), at most `near` (m) from them.

    Also the smooth normals there (n, 3), along which it stands, and whether there is any (n,).
    outward: (n, 3), of the side that the places are on. Next to an edge the surface that faces the
    tool may be another than the one that faces outward; the tool touches the former.
    """
    contacts, normals, off = surface.nearest(flat, outward, 0.25)
    # Where thin parts are hardly sampled, there may be no surface under a place.
    there = off < near
    normals = surface.smooth_normals(contacts, normals, radius_m)
    moving = np.flatnonzero(there)
    for _ in range(_TOUCHES):
        found, _, off = surface.nearest(contacts[moving], normals[moving])
        there[moving] = off < near
        moved = (off > _RESTS) & there[moving]
        moving = moving[moved]
        if not len(moving):
            break
        contacts[moving] = found[moved]
        normals[moving] = surface.smooth_normals(contacts[moving], normals[moving], radius_m)
    return contacts, normals, there


def order_nearest_first(blocks: list[list[SurfacePath]]) -> list[list[SurfacePath]]:
    """Blocks of lines in an order, and each in a direction, that keeps the moves between short."""
    waiting, ordered = list(blocks), []
    place: np.ndarray | None = None
    while waiting:
        if place is None:
            block = waiting.pop(0)
        else:
            ends = np.array([[b[0].contacts[0], b[-1].contacts[-1]] for b in waiting])
            away = np.linalg.norm(ends - place, axis=2)
            which, end = np.unravel_index(np.argmin(away), away.shape)
            block = waiting.pop(int(which))
            if end == 1:
                block = [line.reversed() for line in block[::-1]]
        ordered.append(block)
        place = block[-1].contacts[-1]
    return ordered
