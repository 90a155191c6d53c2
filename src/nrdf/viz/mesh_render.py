"""A mesh with regions and tool paths drawn as a CAM program shows them, without OpenGL.

Triangles fill an image of depth, a row of pixels at a time. What is seen is shaded with normals
that are smooth except at sharp edges; sharp edges and borders of regions are drawn as thin lines,
outlines are set off by depth. Lines are drawn only where nothing lies before them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Protocol

import igl
import numpy as np
from scipy import ndimage

from nrdf.geometry.frames import unit_vectors
from nrdf.geometry.mesh import row_keys, triangle_crosses
from nrdf.viz.canvas import Canvas, counted
from nrdf.viz.palette import AIR_MOVES, INSIDE
from nrdf.viz.view import OVERSAMPLING, eye_dome, reduced

_SHARP_RAD = np.radians(35.0)  # an edge that turns more is drawn, and has two normals
_LAYER = 1e-4  # canonical depth by which a region lies above the object
_SUNK = 0.0015  # canonical depth by which a line may lie in the surface and still be drawn
_STEEP = 0.012  # the same beside an outline, where depth changes within a pixel
_PATH, _EDGE, _AIR = 1.6, 0.8, 1.0  # radius of lines in fine pixels
_DOT = 4.5  # radius of the dot where a region's first line begins
_AT_ONCE = 1 << 16  # pixels
_SAMPLES = 6000  # places of the surface by which a view is chosen
_INK = np.array([0.25, 0.27, 0.31], np.float32)


class Triangles(Protocol):
    """What has vertices (v, 3) and faces (f, 3): a `Mesh`, a `TargetMesh`."""

    @property
    def vertices(self) -> np.ndarray: ...

    @property
    def faces(self) -> np.ndarray: ...


@dataclass(frozen=True)
class PathLines:
    """Lines (k, 3), canonical, of one region's number, with the outward normals (k, 3) of the
    surface under them."""

    region: int
    lines: tuple[np.ndarray, ...]
    normals: tuple[np.ndarray, ...]


@dataclass(frozen=True, eq=False)
class MeshScene:
    """An object ready to draw, canonical.

    corners: (f, 3, 3) of all triangles, with normals (f, 3, 3) at their corners. face_region: (f,),
    -1 for the object itself, whose regions lie above it. edges: sharp edges (e, 2, 3); borders: the
    same of regions. lines: the tool's, on the surface; moves: its ways through the air.
    """

    corners: np.ndarray
    corner_normals: np.ndarray
    face_region: np.ndarray
    edges: np.ndarray
    borders: np.ndarray
    lines: tuple[PathLines, ...] = ()
    moves: tuple[np.ndarray, ...] = ()

    @staticmethod
    def of(
        mesh: Triangles,
        regions: Sequence[tuple[int, Triangles]],
        lines: Mapping[int, Sequence[np.ndarray]],
        moves: Sequence[np.ndarray] = (),
    ) -> MeshScene:
        """Of a canonical mesh, region meshes with their numbers, and each region's lines (k, 3)."""
        parts = [(-1, *_merged(mesh)), *((number, *_merged(part)) for number, part in regions)]
        corners, normals, borders = [], [], [np.zeros((0, 2, 3))]
        for number, vertices, faces in parts:
            corners.append(vertices[faces])
            sharp = np.degrees(_SHARP_RAD)
            normals.append(igl.per_corner_normals(vertices, faces, sharp).reshape(-1, 3, 3))
            if number >= 0:
                borders.append(vertices[igl.boundary_facets(faces)[0]])
        _, vertices, faces = parts[0]
        edges = vertices[_sharp_edges(vertices, faces)]
        surfaces = {number: (vertices, faces) for number, vertices, faces in parts}
        drawn = []
        for number, own in lines.items():
            own = tuple(np.asarray(line, np.float64) for line in own if len(line))
            if own:
                below = surfaces.get(number, surfaces[-1])
                drawn.append(PathLines(number, own, _normals(*below, own)))
        region = np.repeat([number for number, *_ in parts], [len(faces) for *_, faces in parts])
        return MeshScene(
            np.concatenate(corners), np.nan_to_num(np.concatenate(normals)), region, edges,
            np.concatenate(borders), tuple(drawn), tuple(moves),
        )  # fmt: skip

    @cached_property
    def _samples(self) -> tuple[np.ndarray, np.ndarray]:
        """Faces (m,) and places (m, 3) spread evenly over the area of all meshes."""
        rng = np.random.default_rng(0)
        a, b, c = np.moveaxis(self.corners, 1, 0)
        area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
        face = rng.choice(len(area), _SAMPLES, p=area / area.sum())
        share = rng.dirichlet(np.ones(3), _SAMPLES)
        return face, np.einsum("mk,mka->ma", share, self.corners[face])

    @cached_property
    def _columns(self) -> np.ndarray:
        """x, y and z (3, 3 f) of all first corners, all second and all third ones."""
        return np.ascontiguousarray(self.corners.transpose(2, 1, 0)).reshape(3, -1)

    @property
    def points(self) -> np.ndarray:
        """Places (m, 3) on the surface, by area."""
        return self._samples[1]

    @property
    def normals(self) -> np.ndarray:
        """Normals (m, 3) at `points`."""
        a, b, c = np.moveaxis(self.corners[self._samples[0]], 1, 0)
        return unit_vectors(np.cross(b - a, c - a))

    @property
    def region(self) -> np.ndarray:
        """The region (m,) of each of `points`, -1 for none."""
        return np.asarray(self.face_region[self._samples[0]])

    def select(self, mask: np.ndarray, region: int) -> MeshScene:
        """With the lines of one region's number alone; the window cuts off the rest."""
        return replace(self, lines=tuple(own for own in self.lines if own.region == region))

    def render(
        self,
        axes: np.ndarray,
        corner: np.ndarray,
        pixels: float,
        shape: tuple[int, int],
        table: np.ndarray,
        line_colours: np.ndarray,
    ) -> np.ndarray:
        """The scene on white, (h, w, 3) in [0, 1] with the lowest row first, h and w by `shape`.

        axes: rows right, up, towards the viewer (3, 3). `corner` (2,) is the place of the first
        pixel's corner, `pixels` their number per unit length. table: a colour for each region's
        number, the last for none; line_colours: the same for lines.
        """
        shape, pixels = (OVERSAMPLING * shape[0], OVERSAMPLING * shape[1]), OVERSAMPLING * pixels
        # x, y and z of each corner in rows of their own: what follows is bound by memory.
        view = axes @ self._columns
        view[:2] = (view[:2] - np.asarray(corner)[:, None]) * pixels
        view = view.reshape(3, 3, -1)
        layer = _LAYER * (self.face_region + 1.0)
        face, depth = _rasterised(view, layer, shape)
        image = np.ones((*shape, 3), np.float32)
        seen = np.nonzero(face >= 0)
        for start in range(0, len(seen[0]), _AT_ONCE):
            row, column = (one[start : start + _AT_ONCE] for one in seen)
            at = np.stack([column, row], 1) + 0.5
            image[row, column] = self._shaded(view, face[row, column], at, axes, table)
        image *= eye_dome(np.where(face >= 0, depth, np.float32(-1.5)), OVERSAMPLING)[..., None]
        lowest = ndimage.minimum_filter(depth, 3)
        canvas = Canvas(image, depth - np.clip(depth - lowest, _SUNK, _STEEP), axes, corner, pixels)
        canvas.segments(self.edges, _INK, _EDGE, 0.45)
        canvas.segments(self.borders, _INK, _EDGE, 0.9)
        canvas.lines(self.moves, None, np.asarray(AIR_MOVES, np.float32), _AIR)
        for own in self.lines:
            ink = line_colours[own.region]
            canvas.lines(own.lines, own.normals, ink, _PATH)
            canvas.arrows(own.lines, own.normals, ink, _PATH)
            canvas.lines([own.lines[0][:1]], [own.normals[0][:1]], ink, _DOT)
        return reduced(image)

    def _shaded(
        self, view: np.ndarray, face: np.ndarray, at: np.ndarray, axes: np.ndarray,
        table: np.ndarray,
    ) -> np.ndarray:  # fmt: skip
        """Colours (m, 3) of faces (m,) at pixels (m, 2)."""
        a, b, c = (view[:2, k, face].T for k in range(3))
        whole = _cross(b - a, c - a)
        weight = np.stack([_cross(b - at, c - at), _cross(c - at, a - at)], axis=1)
        weight = np.clip(weight / whole[:, None], 0.0, 1.0)
        weight = np.column_stack([weight, np.clip(1.0 - weight.sum(axis=1), 0.0, 1.0)])
        normals = unit_vectors(np.einsum("mk,mka->ma", weight, self.corner_normals[face]))
        back = whole < 0.0
        normals[back] *= -1.0
        key = unit_vectors(np.array([-0.35, 0.75, 0.6])) @ axes
        lit = 0.5 + 0.5 * normals @ key
        # A highlight shows curvature where the shade hardly changes.
        half = unit_vectors(key + axes[2])
        shine = 0.10 * np.clip(normals @ half, 0.0, 1.0) ** 24
        colour = table[self.face_region[face]]
        colour = np.where(back[:, None], np.asarray(INSIDE), colour)
        shade = 0.55 + 0.45 * np.clip(lit, 0.0, 1.0) ** 1.2
        return (colour * shade[:, None] + shine[:, None]).astype(np.float32)


def _rasterised(
    view: np.ndarray, layer: np.ndarray, shape: tuple[int, int]
) -> tuple[np.ndarray, np.ndarray]:
    """The nearest face at each pixel's middle, -1 for none, and its depth, -inf, both `shape`.

    view: (3, 3, f), of each corner x and y in pixels and z towards the viewer; layer: (f,), added
    to the depth of faces that look this way where two meet.
    """
    # Most triangles of a fine mesh lie beyond the window, or between the middles of two rows.
    x, y, _ = view
    low = np.ceil(np.maximum(y.min(axis=0) - 0.5, 0.0))
    high = np.floor(np.minimum(y.max(axis=0) - 0.5, shape[0] - 1.0))
    drawn = np.flatnonzero((high >= low) & (x.max(axis=0) >= 0.0) & (x.min(axis=0) <= shape[1]))
    low, high = low[drawn].astype(np.int64), high[drawn].astype(np.int64)
    depth = np.full(shape[0] * shape[1], -np.inf, np.float32)
    owner = np.full(shape[0] * shape[1], -1)
    for some in _parts(high - low + 1):
        rows = _Rows.of(view[:, :, drawn[some]], low[some], high[some], shape[1])
        count = np.maximum(rows.last - rows.first + 1, 0)
        lifted = np.where(rows.facing, layer[drawn[some]] + _LAYER, 0.0).astype(np.float32)
        for part in _parts(count):
            span, column = counted(count[part], rows.first[part])
            at = rows.start[part][span] + rows.slope[part][span] * column
            at = np.clip(at, rows.farthest[part][span], rows.nearest[part][span])
            face = rows.face[part][span]
            at = at.astype(np.float32) + lifted[face]
            pixel = (rows.row[part] * shape[1])[span] + column
            np.maximum.at(depth, pixel, at)
            wins = at == depth[pixel]
            owner[pixel[wins]] = drawn[some][face[wins]]
    return owner.reshape(shape), np.maximum(depth, np.float32(-10.0)).reshape(shape)


@dataclass(frozen=True)
class _Rows:
    """What triangles cover of rows of pixels (n,): the triangle `face`, the number `row`, the
    `first` and `last` pixel. Depth is `start` + `slope` times the pixel's number, from `farthest`
    to `nearest`. facing: of each triangle (f,), whether it looks this way."""

    face: np.ndarray
    row: np.ndarray
    first: np.ndarray
    last: np.ndarray
    start: np.ndarray
    slope: np.ndarray
    farthest: np.ndarray
    nearest: np.ndarray
    facing: np.ndarray

    @staticmethod
    def of(view: np.ndarray, low: np.ndarray, high: np.ndarray, width: int) -> _Rows:
        """Of triangles (3, 3, f), from row `low` (f,) to `high`, of an image of that width."""
        x, y, z = view
        twice = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0])
        rows = np.where(np.abs(twice) > 1e-9, high - low + 1, 0)
        twice = np.where(rows > 0, twice, 1.0)
        face, row = counted(rows, low)
        # Along a row, a triangle reaches from its longest edge upwards to one of the two others.
        order = y.argsort(axis=0)
        (xa, xb, xc), (ya, yb, yc) = (np.take_along_axis(one, order, axis=0) for one in (x, y))
        height = row + 0.5
        one = xa[face] + (height - ya[face]) * _ratio(xc - xa, yc - ya)[face]
        below = height < yb[face]
        slope = np.where(below, _ratio(xb - xa, yb - ya)[face], _ratio(xc - xb, yc - yb)[face])
        other = xb[face] + (height - yb[face]) * slope
        first = np.ceil(np.clip(np.minimum(one, other) - 0.5, 0.0, width)).astype(np.int64)
        last = np.floor(np.clip(np.maximum(one, other) - 0.5, -1.0, width - 1.0)).astype(np.int64)
        # Depth as a function of the pixel, within what the triangle has: it may be seen edge-on.
        depth_x = ((z[1] - z[0]) * (y[2] - y[0]) - (z[2] - z[0]) * (y[1] - y[0])) / twice
        depth_y = ((z[2] - z[0]) * (x[1] - x[0]) - (z[1] - z[0]) * (x[2] - x[0])) / twice
        start = (z[0] + depth_x * (0.5 - x[0]) - depth_y * y[0])[face] + depth_y[face] * height
        reach = z.min(axis=0)[face], z.max(axis=0)[face]
        return _Rows(face, row, first, last, start, depth_x[face], *reach, twice > 0.0)


def _parts(count: np.ndarray) -> Iterator[slice]:
    """Slices of what has `count` (n,) rows or pixels, about as many in each: all at once would take
    a gigabyte, and leave the processor's cache."""
    total = np.cumsum(count)
    ends = np.arange(_AT_ONCE, int(total[-1]) if len(total) else 0, _AT_ONCE)
    cuts = [0, *np.searchsorted(total, ends), len(count)]
    return (slice(one, other) for one, other in pairwise(cuts))


def _ratio(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    return np.asarray(one / np.where(other == 0.0, 1.0, other))


def _cross(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    return np.asarray(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0])


def _merged(mesh: Triangles) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces with equal vertices made one: without that, all edges are sharp."""
    vertices = np.asarray(mesh.vertices, np.float64)
    vertices = np.round(vertices, 7)
    _, first, index = np.unique(row_keys(vertices), return_index=True, return_inverse=True)
    unique, faces = vertices[first], index.reshape(-1)[np.asarray(mesh.faces, np.int64)]
    return unique, np.ascontiguousarray(faces[triangle_crosses(unique, faces).any(axis=1)])


def _sharp_edges(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Edges (e, 2) at which a mesh turns sharply, or ends."""
    return np.asarray(igl.sharp_edges(vertices, faces, float(_SHARP_RAD))).reshape(-1, 2)


def _normals(
    vertices: np.ndarray, faces: np.ndarray, lines: Sequence[np.ndarray]
) -> tuple[np.ndarray, ...]:
    """Outward normals (k, 3) of the triangles nearest to the points of lines (k, 3)."""
    places = np.concatenate(lines)
    _, face, _ = igl.point_mesh_squared_distance(places, vertices, faces)
    normals = unit_vectors(triangle_crosses(vertices, faces[face]))
    return tuple(np.split(normals, np.cumsum([len(line) for line in lines[:-1]])))
