"""Members (a union of parts made canonical) and families (members from a seed)."""

from __future__ import annotations

import zlib
from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nrdf.shapes.families.base import (
    CAP_START,
    CAP_STOP,
    SIDE,
    SKIN,
    WALL,
    Affine,
    Array,
    Located,
    Part,
    SurfaceCoordinates,
    SurfaceSample,
)

Mask = NDArray[np.bool_]


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
        self._slot_index = np.array([self.slots.index(name) for name in names], np.int32)
        self._grids = [_Grid(part) for part in self.parts]
        lows = np.array([grid.points.min(0) for grid in self._grids])
        highs = np.array([grid.points.max(0) for grid in self._grids])
        low, high = self._bounds(lows, highs)
        self.centre = (low + high) / 2
        self.scale = float((high - low).max())
        to_canonical = Affine(np.eye(3) / self.scale, -self.centre / self.scale)
        self.parts = tuple(part.mapped(to_canonical) for part in parts)
        margin = 0.05 * (highs - lows) / self.scale + 1e-3
        self._low = (lows - self.centre) / self.scale - margin
        self._high = (highs - self.centre) / self.scale + margin

    def _bounds(self, lows: Array, highs: Array) -> tuple[Array, Array]:
        """Tight bounding box, in the parts' unit, from the grids', refined where they touch it."""
        low, high = lows.min(0), highs.max(0)
        offsets = np.linspace(-1, 1, 33)
        for sign, bound, edges in ((-1, low, lows), (1, high, highs)):
            for axis in range(3):
                index = int(np.argmax(sign * edges[:, axis]))
                grid = self._grids[index]
                best = int(np.argmax(sign * grid.points[:, axis]))
                near_v = np.clip(grid.v[best] + 0.11 * offsets * np.abs(offsets), 0, 1)
                u, v = np.meshgrid(grid.u[best] + offsets / 24, near_v)
                face = np.full(u.size, grid.face[best])
                fine = self.parts[index].points(face, u.ravel(), v.ravel())[:, axis]
                bound[axis] = sign * max(sign * bound[axis], (sign * fine).max())
        return low, high

    def occupancy(self, points: Array) -> NDArray[np.bool_]:
        """Whether each canonical point (n, 3) is inside the shape: (n,), exact."""
        return self._inside(np.asarray(points, float))

    def _inside(self, points: Array, owner: NDArray[np.integer] | None = None) -> Mask:
        """Inside any part but the one whose index is in `owner` (n,)."""
        inside = np.zeros(len(points), bool)
        x, y, z = np.ascontiguousarray(points.T)
        for index, part in enumerate(self.parts):
            low, high = self._low[index], self._high[index]
            near = (x >= low[0]) & (x <= high[0]) & (z >= low[2]) & (z <= high[2])
            near &= (y >= low[1]) & (y <= high[1]) & ~inside
            if owner is not None:
                near &= owner != index
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
        owner = np.full(count, -1)
        exists = np.zeros(count, bool)
        for index, (slot, part) in enumerate(zip(self._slot_index, self.parts, strict=True)):
            mine = np.flatnonzero(coordinates.slot == slot)
            face = coordinates.face[mine]
            if len(mine) and face.max() >= WALL:
                mine = mine[np.isin(face, part.faces)]
                face = coordinates.face[mine]
            if len(mine):
                owner[mine] = index
                points[mine], normals[mine], exists[mine] = part.surface(
                    face, coordinates.u[mine], coordinates.v[mine]
                )
        found = np.flatnonzero(exists)
        ahead = points[found] + SKIN * normals[found]
        exists[found] = ~self._inside(ahead, owner[found])
        return Located(points, normals, exists)

    @cached_property
    def _cells(self) -> tuple[Array, Array]:
        """Surface cells (m, 6): slot, face, u0, u1, v0, v1; and their cumulative area (m,)."""
        rows, areas = [], []
        for slot, grid in zip(self._slot_index, self._grids, strict=True):
            a, b, c, d = grid.points[grid.corners]
            areas.append(np.linalg.norm(np.cross(c - a, d - b), axis=1) / 2)
            cell = np.empty((len(a), 6))
            low, high = grid.corners[0], grid.corners[2]
            cell[:, 0], cell[:, 1] = slot, grid.face[low]
            cell[:, 2], cell[:, 3] = grid.u[low], grid.u[high]
            cell[:, 4], cell[:, 5] = grid.v[low], grid.v[high]
            rows.append(cell)
        return np.concatenate(rows), np.cumsum(np.concatenate(areas))

    def sample_surface(self, count: int, rng: np.random.Generator) -> SurfaceSample:
        """`count` points spread by area over the visible skin (even to about a tenth)."""
        got = [self.draw(int(1.4 * count) + 32, rng)]
        while (missing := count - sum(len(g.coordinates) for g in got)) > 0:
            got.append(self.draw(int(1.4 * missing) + 32, rng))
        return SurfaceSample(
            np.concatenate([g.points for g in got])[:count],
            np.concatenate([g.normals for g in got])[:count],
            SurfaceCoordinates.concatenate([g.coordinates for g in got])[:count],
        )

    def draw(self, count: int, rng: np.random.Generator, slot: int | None = None) -> SurfaceSample:
        """The visible ones of `count` random surface points; of one slot (index) if given."""
        cells, area = self._cells
        first, last = 0.0, area[-1]
        if slot is not None:
            mine = np.flatnonzero(cells[:, 0] == slot)
            if not len(mine):
                raise ValueError(f"this member has no slot '{self.slots[slot]}'")
            first, last = area[mine[0] - 1] if mine[0] else 0.0, area[mine[-1]]
        where = np.searchsorted(area, first + rng.random(count) * (last - first), side="right")
        cell = cells[np.minimum(where, len(cells) - 1)]
        mix_u, mix_v = rng.random((2, count))
        coordinates = SurfaceCoordinates(
            cell[:, 0].astype(np.int32),
            cell[:, 1].astype(np.int32),
            cell[:, 2] + mix_u * (cell[:, 3] - cell[:, 2]),
            cell[:, 4] + mix_v * (cell[:, 5] - cell[:, 4]),
        )
        here = self.locate(coordinates)
        keep = here.exists
        return SurfaceSample(here.points[keep], here.normals[keep], coordinates[keep])


class _Grid:
    """Nodes over all faces of a part: face, u, v (n,), points (n, 3); cells by their corners.

    `corners` (4, m) are node indices in order around each cell, lowest (u, v) first.
    """

    def __init__(self, part: Part) -> None:
        walls = len(part.windows)
        plain = [np.full(_PLAIN_U.size, face) for face in (SIDE, CAP_START, CAP_STOP)]
        wall = [np.full(_WALL_U.size, WALL + w.key) for w in part.windows]
        self.face = np.concatenate([*plain, *wall])
        self.u = np.concatenate([_PLAIN_U] * 3 + [_WALL_U] * walls)
        self.v = np.concatenate([_PLAIN_V] * 3 + [_WALL_V] * walls)
        self.points = part.points(self.face, self.u, self.v)
        size, first = _PLAIN_U.size, 3 * _PLAIN_U.size
        self.corners = np.concatenate(
            [_PLAIN_CELLS + size * i for i in range(3)]
            + [_WALL_CELLS + first + _WALL_U.size * i for i in range(walls)],
            axis=1,
        )


def _nodes(v_nodes: Array) -> tuple[Array, Array, NDArray[np.intp]]:
    u, v = np.meshgrid(np.linspace(0, 1, 25), v_nodes)
    node = np.arange(u.size).reshape(u.shape)
    around = node[:-1, :-1], node[:-1, 1:], node[1:, 1:], node[1:, :-1]
    return u.ravel(), v.ravel(), np.stack([corner.ravel() for corner in around])


_PLAIN_U, _PLAIN_V, _PLAIN_CELLS = _nodes((1 - np.cos(np.pi * np.linspace(0, 1, 15))) / 2)
_WALL_U, _WALL_V, _WALL_CELLS = _nodes(np.array([0.0, 1.0]))


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
        return Member(self.slots, self._parts(seed))

    def _parts(self, seed: int) -> list[Part]:
        return self.build(np.random.default_rng([zlib.crc32(self.name.encode()), seed]))

    def canonical_coordinates(
        self, count: int, rng: np.random.Generator, members: int = 200
    ) -> SurfaceCoordinates:
        """A list of surface coordinates (count,) over all slots that members have.

        Pooled evenly by area from `members` random members (and more, for rare slots), so big
        surfaces get most; every slot gets at least its share of an eighth of the list. Shared
        by a whole data set, `member.locate(list)` gives one correspondence group.
        """
        having: dict[int, list[Member]] = {}
        pool = []
        for index, seed in enumerate(rng.integers(2**32, size=members + 1000)):
            if len(having) == len(self.slots) and index >= members:
                break
            parts = self._parts(int(seed))
            slots = {self.slot(part.slot) for part in parts}
            if index >= members and slots <= set(having):
                continue
            member = Member(self.slots, parts)
            pool.append(member.sample_surface(max(2 * count // members, 16), rng).coordinates)
            for slot in slots:
                having.setdefault(slot, []).append(member)
        least = max(count // (8 * len(having)), 1)
        first = []
        for slot, donors in sorted(having.items()):
            picked = rng.choice(len(donors), size=min(len(donors), 4), replace=False)
            drawn = [donors[i].draw(least + 16, rng, slot).coordinates for i in picked]
            mine = SurfaceCoordinates.concatenate(drawn)
            first.append(mine[rng.permutation(len(mine))[:least]])
        reserved = SurfaceCoordinates.concatenate(first)
        rest = SurfaceCoordinates.concatenate(pool)
        rest = rest[rng.permutation(len(rest))[: max(count - len(reserved), 0)]]
        return SurfaceCoordinates.concatenate([reserved, rest])[:count]

    def region(self, name: str, coordinates: SurfaceCoordinates) -> NDArray[np.bool_]:
        """Mask (n,) of the coordinates in one region; ValueError names the regions there are."""
        if name not in self.region_names:
            known = ", ".join(self.region_names)
            raise ValueError(f"no region '{name}' in family {self.name}; it has: {known}")
        return self.region_of(coordinates) == name
