"""Lines of equal value of a function on a mesh, each step of a line within one triangle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nrdf.geometry.polyline_corners import resample_with_corners
from nrdf.geometry.polylines import arc_length, even_arc_lengths, interpolate
from nrdf.surface.fine_mesh import FineMesh

_RING = 4.0  # spacings around: a smaller ring has four steps


@dataclass(frozen=True)
class MeshLine:
    """A line on a mesh. points: (n, 3), m; faces: (n,), the triangle of the step that starts at
    each point; corners: (n, 2) vertices of the edge that the point lies on, share: (n,), how far it
    is from the first to the second; level: number of the value; closed: the last point is the
    first."""

    points: np.ndarray
    faces: np.ndarray
    corners: np.ndarray
    share: np.ndarray
    level: int
    closed: bool

    def values(self, of_vertices: np.ndarray) -> np.ndarray:
        """What values (v,) or (v, d) of the vertices are at the points."""
        share = self.share.reshape(-1, *[1] * (of_vertices.ndim - 1))
        one, other = of_vertices[self.corners[:, 0]], of_vertices[self.corners[:, 1]]
        return np.asarray(one + share * (other - one))


def level_lines(mesh: FineMesh, values: np.ndarray, levels: np.ndarray) -> list[MeshLine]:
    """The lines on which values (v,) at the vertices are one of `levels` (k,), ascending.

    In the order of the levels. Every point lies on an edge of the mesh, every step in a triangle.
    """
    corner = values[mesh.faces]
    # A value that is a level counts as above it: a triangle is then crossed at two edges or none.
    first = np.searchsorted(levels, corner.min(axis=1), side="right")
    last = np.searchsorted(levels, corner.max(axis=1), side="right")
    count = last - first
    face = np.repeat(np.arange(len(mesh.faces)), count)
    if not len(face):
        return []
    level = np.arange(len(face)) - np.repeat(np.cumsum(count) - count, count) + first[face]
    above = corner[face] >= levels[level][:, None]
    crossed = above != np.roll(above, -1, axis=1)
    sides = np.argsort(~crossed, axis=1, kind="stable")[:, :2]
    pairs, of_face = mesh.edges
    key = level[:, None] * len(pairs) + of_face[face[:, None], sides]
    nodes, node = np.unique(key, return_inverse=True)
    node = node.reshape(-1, 2)
    node_level, edge = np.divmod(nodes, len(pairs))
    ends = pairs[edge]
    low, high = values[ends[:, 0]], values[ends[:, 1]]
    share = np.clip((levels[node_level] - low) / (high - low), 0.0, 1.0)
    one, other = mesh.vertices[ends[:, 0]], mesh.vertices[ends[:, 1]]
    points = one + share[:, None] * (other - one)
    lines = []
    for run, steps, closed in _chains(node, len(nodes)):
        faces = face[np.append(steps, steps[-1:])]
        number = int(node_level[run[0]])
        lines.append(MeshLine(points[run], faces, ends[run], share[run], number, closed))
    return sorted(lines, key=lambda line: line.level)


def _chains(steps: np.ndarray, count: int) -> list[tuple[np.ndarray, np.ndarray, bool]]:
    """Steps (s, 2) between `count` nodes as chains: nodes, steps between them, and whether closed.

    Where more than two steps meet, as at an edge of three faces, chains end.
    """
    around: list[list[int]] = [[] for _ in range(count)]
    pairs = steps.tolist()
    for number, (a, b) in enumerate(pairs):
        around[a].append(number)
        around[b].append(number)
    left = [True] * len(pairs)
    found = []

    def walk(node: int, step: int) -> None:
        run, used = [node], []
        while left[step]:
            left[step] = False
            a, b = pairs[step]
            node = b if node == a else a
            run.append(node)
            used.append(step)
            if len(around[node]) != 2:
                break
            one, other = around[node]
            step = other if step == one else one
        closed = len(used) > 2 and run[0] == run[-1]
        found.append((np.array(run), np.array(used), closed))

    for node, incident in enumerate(around):
        if len(incident) != 2:
            for step in incident:
                if left[step]:
                    walk(node, step)
    for step, (a, _) in enumerate(pairs):
        if left[step]:
            walk(a, step)
    return found


def cut_where(line: MeshLine, kept: np.ndarray) -> list[MeshLine]:
    """The parts of a line on which `kept` (n,) is above 0, ended where it passes through 0."""
    good = kept > 0.0
    if good.all():
        return [line]
    if not good.any():
        return []
    points, faces, corners, share = line.points, line.faces, line.corners, line.share
    if line.closed:  # start where it is cut, so that no part is torn at the line's own start
        start = int(np.flatnonzero(~good)[0])
        order = np.append(np.roll(np.arange(len(good) - 1), -start), start)
        order = order % (len(good) - 1)
        points, faces, corners, share = points[order], faces[order], corners[order], share[order]
        good, kept = good[order], kept[order]
    edge = np.flatnonzero(np.diff(np.concatenate([[0], good.astype(int), [0]])))
    parts = []
    for first, end in zip(edge[::2], edge[1::2], strict=True):
        picked = points[first:end]
        at = np.arange(first, end)
        if first > 0:
            way = kept[first] / (kept[first] - kept[first - 1])
            picked = np.vstack([points[first] + way * (points[first - 1] - points[first]), picked])
            at = np.insert(at, 0, first - 1)
        if end < len(points):
            way = kept[end - 1] / (kept[end - 1] - kept[end])
            picked = np.vstack([picked, points[end - 1] + way * (points[end] - points[end - 1])])
            at = np.append(at, end - 1)
        if len(picked) > 1:
            parts.append(MeshLine(picked, faces[at], corners[at], share[at], line.level, False))
    return parts


def resampled(line: MeshLine, spacing_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) of a line in even steps of about `spacing_m`, on the mesh; the triangle (n,) of
    each. Corners of rings, which triangles cut off a little, are made sharp, near the mesh."""
    along = arc_length(line.points)
    if line.closed and along[-1] > _RING * spacing_m:
        points, at = resample_with_corners(line.points, spacing_m, closed=True)
    else:
        least = 4 if line.closed else 1
        at = even_arc_lengths(float(along[-1]), spacing_m, nearest=True, least=least)
        points = interpolate(at, along, line.points)
    step = np.clip(np.searchsorted(along, at, side="right") - 1, 0, len(along) - 2)
    return points, line.faces[step]
