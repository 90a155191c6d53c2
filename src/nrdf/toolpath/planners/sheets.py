"""Sheets: a part cut at its creases, as a slab into top, underside and edges.

A flat tool rests on one side at a time. A part is therefore planned side by side, each with its own
even lines, and not with one field around all of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components, dijkstra

from nrdf.surface.fine_mesh import FineMesh
from nrdf.surface.mesh_patches import Patches
from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.planners.distance import distance_from
from nrdf.toolpath.planners.field_lines import Part
from nrdf.toolpath.strategy import Strategy

_CREASE = float(np.cos(np.radians(30.0)))
"""Cosine between what the tool feels on neighbouring triangles: below it, they are two sides."""
_PER_RADIUS = 3.0  # places along the tool's radius at which its normal is asked for
_ALIKE = float(np.cos(np.radians(50.0)))  # of a narrow sheet with the one that it is merged into
_SPECK = 0.01  # of the footprint's area: smaller sheets are none
_SMALL, _NARROW = 0.5, 0.6  # of the footprint's area; of a stepover
_FACES = float(np.cos(np.radians(45.0)))  # of a closed sheet: which of it is its top
_FLAT = float(np.cos(np.radians(20.0)))  # of its top, which stays whole
_ROUND = 0.75  # of the normals' spread in one direction: that of a round section is a half
_SLENDER = 1.6  # times as long as its section is around
_END = 0.5  # of how wide a strip is: how far its ends reach
_ALIKE_LONG, _BAND = 0.6, 4.0
"""A closed sheet is a band where its two borders are alike in length, by that share, and that many
stepovers apart at most."""
_SHORT, _CONE = 1.0, 0.35
"""Of its border's length: how long a round sheet is that is worked around, at most; and how long
its other border is, at least."""


def sheets_of(region: RegionMesh, part: Part, strategy: Strategy) -> list[Part]:
    """The sides of a part, the largest first: open ones, closed bands, and round rods.

    Cut where the smooth normals that a tool of that radius feels turn sharply. What closes around
    itself without a crease, as a cushion, is cut by the way that it faces; a round rod is not.
    Small and narrow sides go to a neighbour that faces nearly the same way.
    """
    mesh = part.mesh
    facing = felt_normals(region, mesh, strategy.tool_radius_m)
    joints = _joints(mesh)
    number = _merged(mesh, facing, joints, _between_creases(facing, joints), strategy)
    least = _SPECK * np.pi * strategy.tool_radius_m**2
    for one in np.flatnonzero(np.bincount(number, mesh.areas) > least):
        inside = number == one
        sheet = part.sheet(inside)
        closed = sheet.outward is None
        if closed and not is_band(sheet, strategy) and not is_round_rod(sheet):
            number[inside] = (
                number.max() + 1 + _by_facing(sheet, facing, joints, inside, strategy.stepover_m)
            )
    number = _merged(mesh, facing, joints, number, strategy)
    areas = np.bincount(number, mesh.areas)
    order = np.argsort(-areas, kind="stable")
    kept = order[areas[order] > least]
    if len(kept) < 2:
        return [part]
    return [part.sheet(number == k) for k in kept]


def pieces_of(part: Part, chosen: np.ndarray) -> list[Part]:
    """The pieces that hang together of a part's chosen (f,) triangles, the largest first."""
    one, other, _ = _joints(part.mesh)
    within = chosen[one] & chosen[other]
    number = np.where(chosen, _linked(len(chosen), one[within], other[within]), -1)
    kept = np.unique(number[chosen])
    pieces = [part.sheet(number == k) for k in kept]
    return sorted(pieces, key=lambda piece: -float(piece.mesh.areas.sum()))


def felt_normals(region: RegionMesh, mesh: FineMesh, radius_m: float) -> np.ndarray:
    """The smooth normal (f, 3) that a tool feels on each triangle, nearly: one for all triangles
    of a cell that is a fraction of the tool and look to one side."""
    key = ("felt normals", id(region), radius_m)
    if key not in mesh.memo:
        mesh.memo[key] = _felt_normals(region, mesh, radius_m)
    felt: np.ndarray = mesh.memo[key]
    return felt


def _felt_normals(region: RegionMesh, mesh: FineMesh, radius_m: float) -> np.ndarray:
    patches = Patches.of(mesh, radius_m / _PER_RADIUS)
    places, faces = mesh.centres[patches.nearest], mesh.origin[patches.nearest]
    return patches.to_triangles(region.mesh.smooth_normals(places, faces, radius_m))


def is_round_rod(part: Part) -> bool:
    """Whether a part closes around a long and roundish section, as a leg or a bent tube."""
    if part.outward is not None:
        return False
    mesh = part.mesh
    if not _is_round(part):
        return False
    return ends_of(mesh).length_m ** 2 > _SLENDER * float(mesh.areas.sum())


def _is_round(part: Part) -> bool:
    mesh = part.mesh
    spread = (mesh.normals * mesh.areas[:, None]).T @ mesh.normals / mesh.areas.sum()
    return bool(np.linalg.eigvalsh(spread)[-1] <= _ROUND)


def is_band(part: Part, strategy: Strategy) -> bool:
    """Whether a part is a closed band between two borders, as the edge of a round table or a wide
    cone: narrow, or round and no longer than it is around."""
    return part.outward is None and len(band_borders(part, strategy)) == 2


def band_borders(part: Part, strategy: Strategy) -> list[np.ndarray]:
    """The vertices (b,) of each of the two long borders that a band has; none otherwise."""
    loops, lengths = part.mesh.border_loops()
    if len(loops) < 2:
        return []
    first, second = np.argsort(-lengths)[:2]
    across = float(part.mesh.areas.sum()) / float(lengths[first])
    narrow = (
        across <= _BAND * strategy.stepover_m and lengths[second] >= _ALIKE_LONG * lengths[first]
    )
    short = across <= _SHORT * lengths[first] and lengths[second] >= _CONE * lengths[first]
    if narrow or (short and _is_round(part) and not is_round_rod(part)):
        return [loops[first], loops[second]]
    return []


def width(mesh: FineMesh) -> float:
    """About how wide a long mesh with a border is, m; 0 without one."""
    pairs, of_face = mesh.edges
    border = np.bincount(of_face.ravel(), minlength=len(pairs)) == 1
    ends = mesh.vertices[pairs[border]]
    around = float(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).sum())
    return 2.0 * float(mesh.areas.sum()) / around if around else 0.0


@dataclass(frozen=True)
class Ends:
    """The two ends of a long mesh: vertices (a,), (b,); the way between them, and how far every
    vertex (v,) is from the nearer one, m."""

    first: np.ndarray
    last: np.ndarray
    length_m: float
    away: np.ndarray


def ends_of(mesh: FineMesh) -> Ends:
    """What lies farthest apart on a mesh, along its edges."""
    pairs, _ = mesh.edges
    step = np.linalg.norm(mesh.vertices[pairs[:, 0]] - mesh.vertices[pairs[:, 1]], axis=1)
    count = len(mesh.vertices)
    graph = coo_matrix((step, (pairs[:, 0], pairs[:, 1])), (count, count)).tocsr()

    def away_from(vertex: int) -> np.ndarray:
        away = dijkstra(graph, directed=False, indices=vertex)
        return np.where(np.isfinite(away), away, 0.0)

    from_first = away_from(int(np.argmax(away_from(0))))
    from_last = away_from(int(np.argmax(from_first)))
    length = float(from_first.max())
    thick = max(_END * float(mesh.areas.sum()) / max(length, 1e-300), 0.5 * mesh.edge_m)
    first, last = np.flatnonzero(from_first <= thick), np.flatnonzero(from_last <= thick)
    return Ends(first, last, length, np.minimum(from_first, from_last))


def _joints(mesh: FineMesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pairs of triangles (j,), (j,) with a common edge, and its length (j,), m."""
    pairs, of_face = mesh.edges
    sides = of_face.ravel()
    order = np.argsort(sides, kind="stable")
    count = np.bincount(sides, minlength=len(pairs))
    first = np.cumsum(count) - count
    inner = count == 2
    ends = mesh.vertices[pairs[inner]]
    return (
        order[first[inner]] // 3,
        order[first[inner] + 1] // 3,
        np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1),
    )


def _between_creases(facing: np.ndarray, joints: Sequence[np.ndarray]) -> np.ndarray:
    """The number (f,) of the sheet that each triangle is of."""
    one, other, _ = joints
    smooth = np.einsum("ja,ja->j", facing[one], facing[other]) > _CREASE
    return _linked(len(facing), one[smooth], other[smooth])


def _by_facing(
    sheet: Part, facing: np.ndarray, joints: Sequence[np.ndarray], inside: np.ndarray, band_m: float
) -> np.ndarray:
    """Numbers (k,) of a closed sheet's triangles: its top, its underside and what lies between.

    A rounded edge between them is `band_m` wide at least, so that the line on it is as far from
    those beside it as they are from each other.
    """
    chosen = np.flatnonzero(inside)
    axis = np.linalg.eigh(facing[chosen].T @ facing[chosen])[1][:, 2]
    height = facing @ axis
    upper = height > 0.0
    one, other, _ = joints
    within = inside[one] & inside[other]
    turn = within & (upper[one] != upper[other])
    local = np.cumsum(inside) - 1
    rim = np.unique(sheet.mesh.faces[local[one[turn]]])
    if not len(rim):
        return np.zeros(len(chosen), np.int64)
    away = np.zeros(len(facing))
    away[chosen] = distance_from(sheet.mesh, rim)[sheet.mesh.faces].mean(axis=1)
    rounded = (away < 0.5 * band_m) & (np.abs(height) < _FLAT)
    between = (np.abs(height) < _FACES) | rounded
    side = np.where(between, 0, np.where(upper, 1, -1))
    alike = within & (side[one] == side[other])
    return _linked(len(facing), one[alike], other[alike])[chosen]


def _linked(count: int, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    links = coo_matrix((np.ones(len(one), bool), (one, other)), (count, count))
    return np.asarray(connected_components(links, directed=False)[1]).astype(np.int64)


def _merged(
    mesh: FineMesh,
    facing: np.ndarray,
    joints: Sequence[np.ndarray],
    number: np.ndarray,
    strategy: Strategy,
) -> np.ndarray:
    """Numbers (f,) of sheets, small and narrow ones merged into the neighbour most like them."""
    least = _SMALL * np.pi * strategy.tool_radius_m**2
    while True:
        _, number = np.unique(number, return_inverse=True)
        number = number.reshape(-1)
        one, other, length = joints
        seam = number[one] != number[other]
        one, other, length = one[seam], other[seam], length[seam]
        count = int(number.max()) + 1
        area = np.bincount(number, mesh.areas, minlength=count)
        around = _around(mesh, number, count)
        narrow = 2.0 * area < _NARROW * strategy.stepover_m * around
        small = (area < least) | narrow
        if not small.any():
            return number
        here = np.concatenate([number[one], number[other]])
        there = np.concatenate([number[other], number[one]])
        like = np.einsum("ja,ja->j", facing[one], facing[other]) - _ALIKE
        weight = np.concatenate([length * like] * 2)
        key, pair = np.unique(here * count + there, return_inverse=True)
        value = np.bincount(pair.reshape(-1), weight, minlength=len(key))
        # A small sheet goes to a larger one only: to the one that it goes on in most smoothly.
        source, goal = np.divmod(key, count)
        rank = np.empty(count, int)
        rank[np.argsort(area, kind="stable")] = np.arange(count)
        good = small[source] & (value > 0.0) & (rank[goal] > rank[source])
        if not good.any():
            return number
        into = np.arange(count)
        order = np.argsort(value[good], kind="stable")
        into[source[good][order]] = goal[good][order]
        # One step a round: what takes others in stays where it is.
        taking = np.zeros(count, bool)
        taking[into[into != np.arange(count)]] = True
        into = np.where(taking, np.arange(count), into)
        number = into[number]


def _around(mesh: FineMesh, number: np.ndarray, count: int) -> np.ndarray:
    """Length (count,), m, of the border of each sheet."""
    pairs, of_face = mesh.edges
    ends = mesh.vertices[pairs]
    length = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)
    key, times = np.unique(of_face.ravel() * count + np.repeat(number, 3), return_counts=True)
    edge, sheet = np.divmod(key, count)
    return np.bincount(sheet[times == 1], length[edge[times == 1]], minlength=count)
