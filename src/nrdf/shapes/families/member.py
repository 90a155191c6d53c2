"""Members (a union of parts made canonical) and families (members from a seed)."""

from __future__ import annotations

import zlib
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nrdf.shapes.families.base import (
    CAP_START,
    CAP_STOP,
    SKIN,
    WALL,
    Affine,
    Array,
    Located,
    Part,
    SurfaceCoordinates,
    SurfaceSample,
)

_U_NODES = np.linspace(0, 1, 25)
_V_NODES = (1 - np.cos(np.pi * np.linspace(0, 1, 15))) / 2
_WALL_NODES = np.array([0.0, 1.0])


class Member:
    """One watertight shape of a family, in canonical coordinates.

    `parts` are in any common unit; at most one part per slot. `scale` and `centre` (3,) lead back:
    parts' coordinates = canonical * scale + centre.
    """

    def __init__(self, slots: Sequence[str], parts: Sequence[Part]) -> None:
        self.slots = tuple(slots)
        names = [part.slot for part in parts]
        unknown = set(names) - set(slots)
        if unknown or len(set(names)) < len(names):
            raise ValueError(f"parts need distinct slots out of {self.slots}; got {names}")
        self.parts = tuple(parts)
        low, high = self._bounds()
        self.centre = (low + high) / 2
        self.scale = float((high - low).max())
        to_canonical = Affine(np.eye(3) / self.scale, -self.centre / self.scale)
        self.parts = tuple(part.mapped(to_canonical) for part in parts)
        self._slot_index = np.array([self.slots.index(name) for name in names], np.int32)
        margin = 0.05 * (self._grid_high - self._grid_low) / self.scale + 1e-3
        self._low = (self._grid_low - self.centre) / self.scale - margin
        self._high = (self._grid_high - self.centre) / self.scale + margin

    def _bounds(self) -> tuple[Array, Array]:
        """Tight bounding box, in the parts' unit: a grid, refined around its extreme points."""
        grids = [
            [(f, u, v, part.points(f, u, v)) for f, u, v in _grids(part) if f < WALL]
            for part in self.parts
        ]
        self._grid_low = np.array([np.min([g[3].min(0) for g in gs], 0) for gs in grids])
        self._grid_high = np.array([np.max([g[3].max(0) for g in gs], 0) for gs in grids])
        low, high = self._grid_low.min(0), self._grid_high.max(0)
        offsets = np.linspace(-1, 1, 41)
        for axis in range(3):
            for sign, bound, edge in ((-1, low, self._grid_low), (1, high, self._grid_high)):
                index = int(np.argmax(sign * edge[:, axis]))
                face, u, v, points = max(grids[index], key=lambda g: (sign * g[3][:, axis]).max())
                best = int(np.argmax(sign * points[:, axis]))
                near_v = np.clip(v[best] + 0.11 * offsets * np.abs(offsets), 0, 1)
                near_u = u[best] + offsets / 24
                a, b = (x.ravel() for x in np.meshgrid(near_u, near_v))
                fine = self.parts[index].points(face, a, b)[:, axis]
                bound[axis] = sign * max(sign * bound[axis], (sign * fine).max())
        return low, high

    def occupancy(self, points: Array) -> NDArray[np.bool_]:
        """Whether each canonical point (n, 3) is inside the shape: (n,), exact."""
        return self._inside(np.asarray(points, float), skip=-1)

    def _inside(self, points: Array, skip: int) -> NDArray[np.bool_]:
        """Inside any part but the one with index `skip`."""
        inside = np.zeros(len(points), bool)
        for index, part in enumerate(self.parts):
            if index == skip:
                continue
            near = ~inside
            for axis in range(3):
                near &= points[:, axis] >= self._low[index, axis]
                near &= points[:, axis] <= self._high[index, axis]
            where = np.flatnonzero(near)
            if len(where):
                inside[where] = part.inside(points[where])
        return inside

    def locate(self, coordinates: SurfaceCoordinates) -> Located:
        """The points of this member at surface coordinates (n,) taken from any member.

        exists is False where this member has no such part or window, where the place is cut away
        by a window, and where it is buried in another part.
        """
        count = len(coordinates)
        points, normals = np.zeros((count, 3)), np.zeros((count, 3))
        exists = np.zeros(count, bool)
        key = coordinates.slot.astype(np.int64) << 32 | coordinates.face
        order = np.argsort(key, kind="stable")
        _, starts = np.unique(key[order], return_index=True)
        for where in np.split(order, starts[1:]):
            if not len(where):
                continue
            found = np.flatnonzero(self._slot_index == coordinates.slot[where[0]])
            face = int(coordinates.face[where[0]])
            if not len(found) or not self.parts[found[0]].has_face(face):
                continue
            surface = self.parts[found[0]].surface(face, coordinates.u[where], coordinates.v[where])
            points[where], normals[where], exists[where] = surface
        for index, slot in enumerate(self._slot_index):
            mine = np.flatnonzero(exists & (coordinates.slot == slot))
            if len(mine):
                ahead = points[mine] + SKIN * normals[mine]
                exists[mine] = ~self._inside(ahead, skip=index)
        return Located(points, normals, exists)

    @cached_property
    def _cells(self) -> tuple[Array, Array]:
        """Surface cells (m, 6): slot, face, u0, u1, v0, v1; and their cumulative area (m,)."""
        rows, areas = [], []
        for index, part in enumerate(self.parts):
            for face, u, v in _grids(part):
                nodes = _WALL_NODES if face >= WALL else _V_NODES
                shape = (len(nodes), len(_U_NODES))
                grid = part.points(face, u, v).reshape(*shape, 3)
                diagonals = grid[1:, 1:] - grid[:-1, :-1], grid[1:, :-1] - grid[:-1, 1:]
                areas.append(np.linalg.norm(np.cross(*diagonals), axis=-1).ravel() / 2)
                a, b = u.reshape(shape), v.reshape(shape)
                cell = np.empty((shape[0] - 1, shape[1] - 1, 6))
                cell[..., 0], cell[..., 1] = self._slot_index[index], face
                cell[..., 2], cell[..., 3] = a[:-1, :-1], a[:-1, 1:]
                cell[..., 4], cell[..., 5] = b[:-1, :-1], b[1:, :-1]
                rows.append(cell.reshape(-1, 6))
        return np.concatenate(rows), np.cumsum(np.concatenate(areas))

    def sample_surface(self, count: int, rng: np.random.Generator) -> SurfaceSample:
        """`count` points spread evenly by area over the visible skin."""
        cells, area = self._cells
        got: list[SurfaceSample] = []
        missing = count
        while missing > 0:
            draw = int(1.4 * missing) + 32
            cell = cells[np.searchsorted(area, rng.random(draw) * area[-1], side="right")]
            mix_u, mix_v = rng.random((2, draw))
            coordinates = SurfaceCoordinates(
                cell[:, 0].astype(np.int32),
                cell[:, 1].astype(np.int32),
                cell[:, 2] + mix_u * (cell[:, 3] - cell[:, 2]),
                _between(
                    cell[:, 4], cell[:, 5], mix_v, disc=np.isin(cell[:, 1], (CAP_START, CAP_STOP))
                ),
            )
            here = self.locate(coordinates)
            keep = np.flatnonzero(here.exists)[:missing]
            got.append(SurfaceSample(here.points[keep], here.normals[keep], coordinates[keep]))
            missing -= len(keep)
        return SurfaceSample(
            np.concatenate([g.points for g in got]),
            np.concatenate([g.normals for g in got]),
            SurfaceCoordinates.concatenate([g.coordinates for g in got]),
        )


def _between(low: Array, high: Array, mix: Array, disc: NDArray[np.bool_]) -> Array:
    """Random v in a cell, even by area: on a disc (a cap) area grows with v squared."""
    squared = np.sqrt(low**2 + mix * (high**2 - low**2))
    return np.where(disc, squared, low + mix * (high - low))


def _grids(part: Part) -> Iterator[tuple[int, Array, Array]]:
    """For each face of a part: face, u and v of a grid's nodes, flattened with u fastest."""
    for face in part.faces:
        u, v = np.meshgrid(_U_NODES, _WALL_NODES if face >= WALL else _V_NODES)
        yield face, u.ravel(), v.ravel()


class Family(ABC):
    """Members from a seed, all of whose surface coordinates share the same slots.

    Subclasses set `name`, `slots` (every slot any member may have) and `region_names`, and
    implement `build` and `region_of`.
    """

    name: str
    slots: tuple[str, ...]
    region_names: tuple[str, ...]

    @abstractmethod
    def build(self, rng: np.random.Generator) -> list[Part]:
        """The parts of a random member, at most one a slot, in any common unit."""

    @abstractmethod
    def region_of(self, coordinates: SurfaceCoordinates) -> NDArray[np.str_]:
        """The name of the region each coordinate lies in, "" for none: (n,)."""

    def slot(self, name: str) -> int:
        """The index that surface coordinates use for a slot."""
        return self.slots.index(name)

    def member(self, seed: int) -> Member:
        """The member that belongs to a seed (any non-negative integer)."""
        rng = np.random.default_rng([zlib.crc32(self.name.encode()), seed])
        return Member(self.slots, self.build(rng))

    def canonical_coordinates(
        self, count: int, rng: np.random.Generator, members: int = 200
    ) -> SurfaceCoordinates:
        """A list of surface coordinates (count,) over all slots that members have.

        Pooled evenly by area from `members` random members, so big surfaces get most; each slot
        that occurred gets at least its share of an eighth of the list. Shared by a whole data
        set, `member.locate(list)` gives one correspondence group.
        """
        seeds = rng.integers(2**32, size=members)
        per_member = max(2 * count // members, 64)
        pool = SurfaceCoordinates.concatenate(
            [self.member(int(s)).sample_surface(per_member, rng).coordinates for s in seeds]
        )
        order = rng.permutation(len(pool))
        slots = pool.slot[order]
        present = np.unique(slots)
        least = count // (8 * len(present))
        first = [order[np.flatnonzero(slots == s)[:least]] for s in present]
        chosen = np.concatenate([*first, order[~np.isin(order, np.concatenate(first))]])[:count]
        return pool[np.sort(chosen)]

    def region(self, name: str, coordinates: SurfaceCoordinates) -> NDArray[np.bool_]:
        """Mask (n,) of the coordinates in one region; ValueError names the regions there are."""
        if name not in self.region_names:
            known = ", ".join(self.region_names)
            raise ValueError(f"no region '{name}' in family {self.name}; it has: {known}")
        return self.region_of(coordinates) == name
