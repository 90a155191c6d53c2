"""The parts model that every family rests on: lofts, exact maps, members with surface coordinates.

A member is a union of parts. A part is a loft: cross-sections perpendicular to an axis, two flat
caps, windows cut through, then exactly invertible maps. So occupancy is exact (invert the maps,
read s, test the section), and every surface point has coordinates (slot, face, u, v) that mean the
same place on every member which has that slot.

Right-handed, +X forward, +Y up, +Z right-hand side. Lengths inside a part may be in any unit (the
families use metres); a `Member` is canonical: bounding box centred, longest side 1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from nrdf.shapes.families.sections import TINY, Array, Curve, Section, at

Faces = NDArray[np.integer]

SIDE, CAP_START, CAP_STOP, WALL = 0, 1, 2, 3
"""Faces of a part; the wall of window w is face WALL + w.key."""

STEP = 1e-5  # of the finite differences (in u, s and, times the part's length, in the cap's plane)
SKIN = 1e-4  # canonical distance: nothing may lie this far in front of a visible surface point


class Map(Protocol):
    """An exactly invertible map of space, (n, 3) to (n, 3); orientation is its Jacobian's sign."""

    @property
    def orientation(self) -> float: ...
    def forward(self, points: Array) -> Array: ...
    def inverse(self, points: Array) -> Array: ...


@dataclass(frozen=True)
class Affine:
    """points @ matrix.T + shift."""

    matrix: Array = field(default_factory=lambda: np.eye(3))
    shift: Array = field(default_factory=lambda: np.zeros(3))

    @cached_property
    def _inverse(self) -> Array:
        return np.asarray(np.linalg.inv(self.matrix), np.float64)

    @cached_property
    def orientation(self) -> float:
        return float(np.sign(np.linalg.det(self.matrix)))

    def forward(self, points: Array) -> Array:
        return points @ self.matrix.T + self.shift

    def inverse(self, points: Array) -> Array:
        return (points - self.shift) @ self._inverse.T

    def then(self, other: Affine) -> Affine:
        return Affine(other.matrix @ self.matrix, other.matrix @ self.shift + other.shift)


@dataclass(frozen=True)
class Warp:
    """One coordinate c becomes anchor + (c - anchor) * scale + offset; scale > 0.

    `offset` and `scale` are functions of the other two coordinates in cyclic order: for axis 0
    (x) of (y, z), for axis 1 (y) of (z, x), for axis 2 (z) of (x, y). Each takes and returns (n,).
    """

    axis: int
    offset: Callable[[Array, Array], Array] | None = None
    scale: Callable[[Array, Array], Array] | None = None
    anchor: float = 0.0
    orientation: float = 1.0

    def _factors(self, points: Array) -> tuple[Array | float, Array | float]:
        j, k = points[:, (self.axis + 1) % 3], points[:, (self.axis + 2) % 3]
        return (
            1.0 if self.scale is None else self.scale(j, k),
            0.0 if self.offset is None else self.offset(j, k),
        )

    def forward(self, points: Array) -> Array:
        scale, offset = self._factors(points)
        out = points.copy()
        out[:, self.axis] = self.anchor + (points[:, self.axis] - self.anchor) * scale + offset
        return out

    def inverse(self, points: Array) -> Array:
        scale, offset = self._factors(points)
        out = points.copy()
        out[:, self.axis] = self.anchor + (points[:, self.axis] - self.anchor - offset) / scale
        return out


def rotation(axis: int, angle: float, pivot: Sequence[float] = (0.0, 0.0, 0.0)) -> Affine:
    """Right-handed rotation by `angle` (rad) about the line through `pivot` along the axis."""
    j, k = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(3)
    matrix[[j, k, j, k], [j, k, k, j]] = np.cos([angle, angle, 0, 0])
    matrix[j, k], matrix[k, j] = -np.sin(angle), np.sin(angle)
    centre = np.asarray(pivot, float)
    return Affine(matrix, centre - matrix @ centre)


MIRROR_Z = Affine(np.diag([1.0, 1.0, -1.0]))


@dataclass(frozen=True)
class Window:
    """A hole right through a part along q: a superellipse in (xi, s).

    xi = p / half-width in [-1, 1]; exponent inf is a rectangle. Walls of windows with the same
    key correspond; give windows of different meaning (another count of slats) other keys.
    """

    xi: float
    s: float
    half_xi: float
    half_s: float
    exponent: float = np.inf
    key: int = 0

    def contains(self, xi: Array, s: Array) -> NDArray[np.bool_]:
        x, y = np.abs(xi - self.xi) / self.half_xi, np.abs(s - self.s) / self.half_s
        if np.isinf(self.exponent):
            return np.maximum(x, y) < 1
        return x**self.exponent + y**self.exponent < 1

    def outline(self, u: Array) -> tuple[Array, Array]:
        """(xi, s) at polar angle 2 pi u of the window's boundary."""
        c, d = np.cos(2 * np.pi * u), np.sin(2 * np.pi * u)
        if np.isinf(self.exponent):
            radius = 1 / np.maximum(np.abs(c), np.abs(d))
        else:
            radius = (np.abs(c) ** self.exponent + np.abs(d) ** self.exponent) ** (
                -1 / self.exponent
            )
        return self.xi + self.half_xi * radius * c, self.s + self.half_s * radius * d


@dataclass(frozen=True)
class Part:
    """A loft from `start` to `stop` (> start) along coordinate `axis`, then maps in order.

    Section coordinates are (p, q) = the next two axes in cyclic order: axis x has (y, z), axis y
    has (z, x), axis z has (x, y). `centre` is the section's centre (p, q) along s.

    `station` maps (u, v) of the SIDE to s, rising in v from 0 to 1 for every u: it lets v stand for
    a place that means the same on every member (a windscreen's base) wherever it lies on this one.

    Faces: SIDE has u around the section and v = s (or station); CAP_START and CAP_STOP have u
    around and v = the fraction from the section's centre to its boundary; a window's wall has u
    around the window and v through the thickness from -q to +q.
    """

    slot: str
    axis: int
    start: float
    stop: float
    section: Section
    centre: tuple[Curve, Curve] = (0.0, 0.0)
    windows: tuple[Window, ...] = ()
    maps: tuple[Map, ...] = ()
    station: Callable[[Array, Array], Array] | None = None

    def __post_init__(self) -> None:
        if not self.stop > self.start:
            raise ValueError(f"part {self.slot}: stop {self.stop} must exceed start {self.start}")

    def mapped(self, *maps: Map, slot: str | None = None) -> Part:
        """This part with further maps, and another slot where given."""
        chain = list(self.maps)
        for step in maps:
            if chain and isinstance(step, Affine) and isinstance(chain[-1], Affine):
                chain[-1] = chain[-1].then(step)
            else:
                chain.append(step)
        return replace(self, maps=tuple(chain), slot=self.slot if slot is None else slot)

    def mirrored(self, slot: str) -> Part:
        """This part reflected in the plane z = 0, for the other side's slot."""
        return self.mapped(MIRROR_Z, slot=slot)

    def _map(self, p: Array, q: Array, s: Array) -> Array:
        points: Array = np.empty((len(s), 3))
        points[:, self.axis] = self.start + (self.stop - self.start) * s
        points[:, (self.axis + 1) % 3] = at(self.centre[0], s) + p
        points[:, (self.axis + 2) % 3] = at(self.centre[1], s) + q
        for step in self.maps:
            points = step.forward(points)
        return points

    def inside(self, points: Array) -> NDArray[np.bool_]:
        """Exact occupancy, (n, 3) to (n,)."""
        for step in reversed(self.maps):
            points = step.inverse(points)
        s = (points[:, self.axis] - self.start) / (self.stop - self.start)
        inside = (s >= 0) & (s <= 1)
        s = np.clip(s, 0.0, 1.0)
        p = points[:, (self.axis + 1) % 3] - at(self.centre[0], s)
        q = points[:, (self.axis + 2) % 3] - at(self.centre[1], s)
        inside &= self.section.inside(p, q, s)
        if self.windows:
            inside &= ~self._cut(p, s)
        return inside

    def _cut(
        self, p: Array, s: Array, skip: NDArray[np.integer] | None = None
    ) -> NDArray[np.bool_]:
        """Whether a window lies at (p, s), other than the one whose index is in `skip` (n,)."""
        xi = p / np.maximum(self.section.half_width(s), TINY)
        cut = np.zeros(len(s), bool)
        for index, window in enumerate(self.windows):
            here = window.contains(xi, s)
            cut |= here if skip is None else here & (skip != index)
        return cut

    @property
    def faces(self) -> list[int]:
        """The faces that this part has."""
        return [SIDE, CAP_START, CAP_STOP, *(WALL + w.key for w in self.windows)]

    def _local(
        self, face: Faces, u: Array, v: Array, wall: NDArray[np.intp]
    ) -> tuple[Array, Array, Array]:
        """Section coordinates and s, (n,) each."""
        along = v if self.station is None else self.station(u, v)
        rho, s = np.where(face == SIDE, 1.0, v), np.where(face == SIDE, along, face == CAP_STOP)
        if not len(wall):
            return *self.section.disc(u, rho, s), s
        p, q = np.empty_like(u), np.empty_like(u)
        for index in np.unique(face[wall]):
            of = wall[face[wall] == index]
            window = next(w for w in self.windows if w.key == index - WALL)
            xi, s[of] = window.outline(u[of])
            inner = np.clip(s[of], 0, 1)
            low, high = self.section.chord(np.clip(xi, -1, 1), inner)
            p[of], q[of] = xi * self.section.half_width(inner), low + v[of] * (high - low)
        rest = np.flatnonzero(face < WALL)
        p[rest], q[rest] = self.section.disc(u[rest], rho[rest], s[rest])
        return p, q, s

    def points(self, face: Faces, u: Array, v: Array) -> Array:
        """Surface points (n, 3) of faces that this part has."""
        return self._map(*self._local(face, u, v, np.flatnonzero(face >= WALL)))

    def surface(self, face: Faces, u: Array, v: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Points (n, 3), unit outward normals (n, 3), and whether material ends there (n,).

        `face` (n,) may only name faces that this part has.
        """
        low, high = np.maximum(v - STEP, 0), np.minimum(v + STEP, 1)
        faces, us = np.tile(face, 5), np.concatenate([u, u - STEP, u + STEP, u, u])
        walls = np.flatnonzero(faces >= WALL)
        local = self._local(faces, us, np.concatenate([v, v, v, low, high]), walls)
        p, q, s = (x.reshape(5, -1) for x in local)
        cap = np.flatnonzero((face == CAP_START) | (face == CAP_STOP))
        h = STEP * (self.stop - self.start)
        p[:, cap] = p[0, cap] + h * np.array([[0], [-1], [1], [0], [0]])
        q[:, cap] = q[0, cap] + h * np.array([[0], [0], [0], [-1], [1]])
        centre, back, forth, down, up = self._map(*local).reshape(5, -1, 3)
        normals = np.cross(forth - back, up - down)
        length = np.linalg.norm(normals, axis=1)
        exists = length > 0
        sign = np.where(face == CAP_START, -1.0, 1.0) / np.maximum(length, 1e-300)
        for step in self.maps:
            sign *= step.orientation
        if self.windows:
            keys = np.array([w.key for w in self.windows])
            own = np.where(face[:, None] == WALL + keys, np.arange(len(keys)), -1).max(1)
            inner = np.clip(s[0], 0, 1)
            exists &= ~self._cut(p[0], inner, skip=own)
            exists &= (own < 0) | (
                (np.abs(p[0]) < self.section.half_width(inner)) & (s[0] > 0) & (s[0] < 1)
            )
        return centre, normals * sign[:, None], exists


@dataclass(frozen=True)
class SurfaceCoordinates:
    """Where on a family's surface: slot (n,) index into family.slots, face (n,), u, v (n,)."""

    slot: NDArray[np.int32]
    face: NDArray[np.int32]
    u: Array
    v: Array

    def __len__(self) -> int:
        return len(self.slot)

    def __getitem__(self, index: NDArray | slice) -> SurfaceCoordinates:
        return SurfaceCoordinates(self.slot[index], self.face[index], self.u[index], self.v[index])

    @staticmethod
    def concatenate(several: Sequence[SurfaceCoordinates]) -> SurfaceCoordinates:
        return SurfaceCoordinates(
            *(np.concatenate([getattr(c, k) for c in several]) for k in ("slot", "face", "u", "v"))
        )


@dataclass(frozen=True)
class SurfaceSample:
    """Canonical points (n, 3), unit outward normals (n, 3) and their coordinates."""

    points: Array
    normals: Array
    coordinates: SurfaceCoordinates


@dataclass(frozen=True)
class Located:
    """Canonical points and unit outward normals (n, 3); exists (n,) False: no such place here.

    Where the slot is absent, point and normal are 0.
    """

    points: Array
    normals: Array
    exists: NDArray[np.bool_]
