"""A region cut into patches that can be unrolled, and the smooth surface over each of them."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from nrdf.errors import ProcessError
from nrdf.geometry.frames import unit_vectors
from nrdf.geometry.quadrics import quadrics
from nrdf.surface.border import CONTEXT, OTHER, OWN, Border
from nrdf.surface.surface import Surface, typical_spacing
from nrdf.surface.unroll import Unrolled, unroll

log = logging.getLogger(__name__)

_FEWEST = 4  # points of a patch
_BENT, _BENT_SHARE = 0.2, 0.03  # a patch with more of its points bent this much is cut in two
_DEEPEST = 5  # cuts
_SCRAP = 0.03  # smaller shares are not cut off
_LEAST_STRETCH, _MOST_STRETCH = 0.7, 1.4
_LEVEL = 0.85  # cosine between the normals of neighbours on one face
_FITTED = 20
_LONG = 1.2  # ratio of variances along and across from which a patch is longer than wide


@dataclass(frozen=True)
class Patch:
    """A connected piece of a region that lies flat without folds, with what surrounds it.

    index: (n,) of its points among the surface's; points: (n, 3), m; uv: (n, 2), m, their places
    in the plane; tangents: (n, 2, 3), unit, along u and v; label: (n,), OWN, OTHER or CONTEXT;
    spacing: typical distance between points, m.
    """

    index: np.ndarray
    points: np.ndarray
    uv: np.ndarray
    tangents: np.ndarray
    label: np.ndarray
    spacing: float

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.uv)

    @cached_property
    def normals(self) -> np.ndarray:
        """Outward unit normals (n, 3) of the points."""
        return np.cross(self.tangents[:, 0], self.tangents[:, 1])

    @cached_property
    def border(self) -> Border:
        return Border(self.uv, self.label, self.spacing)

    def at(self, uv: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The smooth surface at `uv` (m, 2): positions (m, 3), derivatives by u and v (m, 2, 3).

        Moving least squares in the plane: a quadratic map fitted to the nearest points.
        """
        distance, near = self._tree.query(uv, min(_FITTED, len(self.uv)))
        weight = (1.0 - (distance / (1.05 * distance[:, -1:] + 1e-12)) ** 2) ** 2
        origin, middle = self.points[near[:, 0]], self.uv[near[:, 0]]
        offset = self.points[near] - origin[:, None]
        # Points that are nearer in the plane than in space lie beyond a gap or round an edge.
        flat = np.linalg.norm(self.uv[near] - middle[:, None], axis=2)
        weight *= np.linalg.norm(offset, axis=2) < 1.3 * flat + 0.5 * self.spacing
        found = quadrics((self.uv[near] - uv[:, None]) / self.spacing, offset, weight)
        return origin + found[:, 0], found[:, 1:3] / self.spacing

    def smooth_normals(self, uv: np.ndarray, radius_m: float) -> np.ndarray:
        """Outward normals (m, 3), averaged over the patch within `radius_m` of `uv` (m, 2).

        What a flat tool of that radius feels; where the patch is narrower, that of all its width.
        """
        radius = max(radius_m, 2.0 * self.spacing)
        count = int(np.clip(1.5 * np.pi * (radius / self.spacing) ** 2, 16, 256))
        distance, near = self._tree.query(uv, min(count, len(self.uv)))
        weight = np.maximum(1.0 - (distance / radius) ** 2, 1e-6) ** 2
        return unit_vectors(np.einsum("mk,mka->ma", weight, self.normals[near]))

    @cached_property
    def metric(self) -> np.ndarray:
        """Metric tensors (n, 2, 2) at the points: lengths on the surface by lengths in uv.

        What an unrolled patch stretches is within bounds; beyond, it is the points' noise.
        """
        along = self.at(self.uv)[1]
        squared, axes = np.linalg.eigh(np.einsum("nia,nja->nij", along, along))
        bounded = np.clip(squared, _LEAST_STRETCH**2, _MOST_STRETCH**2)
        return np.einsum("nik,nk,njk->nij", axes, bounded, axes)

    def angle_of(self, direction: np.ndarray) -> tuple[float, float]:
        """Angle (rad) in the plane of a direction (3,), and its mean share [0, 1] that lies in
        the surface."""
        seen = self.tangents[self.label == OWN] @ (direction / np.linalg.norm(direction))
        mean = seen.mean(axis=0)
        return float(np.arctan2(mean[1], mean[0])), float(np.linalg.norm(mean))

    @cached_property
    def extent(self) -> tuple[float, float, float]:
        """Length and width (m) of the rectangle around, and the angle of the length.

        Along the principal axis of the patch's area; where that is nearly round or square, along
        the smallest rectangle.
        """
        grid = self.border.grid
        area = grid.nodes[self.border.clearance(grid.nodes, 0.0) > 0.0]
        area = area if len(area) > 2 else self.uv[self.label == OWN]
        squared, axes = np.linalg.eigh(np.cov(area.T))
        angles = np.radians(np.arange(90.0))
        if squared[1] > _LONG * squared[0]:
            angles = np.arctan2(axes[1:, 1], axes[:1, 1])
        c, s = np.cos(angles)[:, None], np.sin(angles)[:, None]
        along = np.ptp(c * area[:, 0] + s * area[:, 1], axis=1)
        across = np.ptp(c * area[:, 1] - s * area[:, 0], axis=1)
        best = int(np.argmin(along * across))
        length, width, angle = float(along[best]), float(across[best]), float(angles[best])
        return (length, width, angle) if length >= width else (width, length, angle + np.pi / 2)


def patches_of(surface: Surface, region: np.ndarray) -> tuple[Patch, ...]:
    """The patches of a region, indices (k,) of the surface's points, the largest first.

    Found once for each region of a surface. Raises ProcessError for a region that is empty, not of
    this cloud, or whose points are too few or too scattered.
    """
    own = surface.check_region(region)
    key = "patches", own.tobytes()
    if key not in surface.found:
        surface.found[key] = _cut(surface, own)
    patches: tuple[Patch, ...] = surface.found[key]
    return patches


def inside_margin(
    surface: Surface, region: np.ndarray, patches: Sequence[Patch], margin: float
) -> np.ndarray:
    """Indices of the region's points that are not in the margin along its border."""
    inside = np.zeros(len(surface.points), bool)
    inside[surface.check_region(region)] = True
    if margin > 0.0:
        for patch in patches:
            own = patch.label == OWN
            inside[patch.index[own]] = patch.border.distance(patch.uv[own]) >= margin
    return np.flatnonzero(inside)


def _cut(surface: Surface, region: np.ndarray) -> tuple[Patch, ...]:
    waiting = [(part, 0) for part in _components(surface, region)]
    found: list[tuple[np.ndarray, np.ndarray, Unrolled]] = []
    while waiting:
        own, depth = waiting.pop()
        if len(own) < _FEWEST:
            continue
        # No surroundings where they close a tube or go round an edge.
        for hops, most in ((1 if depth else 2, 0.5 * _BENT), (0, _BENT)):
            around = _surroundings(surface, own, hops)
            edges = _edges_within(surface, around)
            flat = unroll(surface.points[around], surface.normals[around], edges, surface.spacing)
            mine = np.isin(around, own)
            bent = (flat.error > most) | _folded(surface.points[around], flat.uv)
            share = bent[mine].mean()
            if share <= _BENT_SHARE:
                break
        if depth < _DEEPEST and share > _BENT_SHARE:
            waiting += [(part, depth + 1) for part in _halves(surface, own)]
        else:
            # At a saddle there is too much surface for the plane: surroundings lie over the patch.
            kept = mine | ~bent
            found.append((own, around[kept], flat.among(kept)))
    if not found:
        raise ProcessError(
            f"the region's {len(region)} points are too few or too scattered for a tool path; it "
            f"needs at least {_FEWEST} neighbouring ones"
        )
    found.sort(key=lambda patch: -len(patch[0]))
    owner = np.full(len(surface.points), -1)
    owner[region] = len(found)  # scattered points: of whichever patch is around them
    for k, (own, _, _) in enumerate(found):
        owner[own] = k
    scattered = int((owner == len(found)).sum())
    if scattered:
        log.debug("%d scattered points of a region of %d have no lines", scattered, len(region))
    return tuple(
        _patch(surface, around, flat, _labels(owner[around], k, len(found)))
        for k, (_, around, flat) in enumerate(found)
    )


def _folded(points: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """Whether (n,) points (n, 3) lie over others in the plane uv (n, 2) that are elsewhere."""
    away, near = cKDTree(uv).query(uv, min(4, len(uv)))
    apart = np.linalg.norm(points[near] - points[:, None], axis=2)
    return (apart > 3.0 * away + 1e-9).any(axis=1)


def _labels(owner: np.ndarray, patch: int, nobody: int) -> np.ndarray:
    """Labels (n,) from the patch that owns each point: -1 where none of the region does."""
    label = np.where(owner == -1, CONTEXT, OTHER)
    return np.where((owner == patch) | (owner == nobody), OWN, label)


def _patch(surface: Surface, around: np.ndarray, flat: Unrolled, label: np.ndarray) -> Patch:
    count = min(5, len(around))
    distance = cKDTree(flat.uv).query(flat.uv[label == OWN], count)[0][:, -1]
    spacing = min(typical_spacing(distance, count - 1), 1.3 * surface.spacing)
    return Patch(around, surface.points[around], flat.uv, flat.tangents, label, spacing)


def _components(surface: Surface, chosen: np.ndarray) -> list[np.ndarray]:
    """Connected sets of the chosen points (k,), each as indices of the surface's points."""
    which = _components_of(_edges_within(surface, chosen), len(chosen))
    order = np.argsort(which, kind="stable")
    return np.split(chosen[order], np.cumsum(np.bincount(which))[:-1])


def _components_of(edges: np.ndarray, count: int) -> np.ndarray:
    """The number (n,) of the connected component that each of `count` points is in."""
    graph = sparse.csr_matrix((np.ones(len(edges)), edges.T), (count, count))
    return connected_components(graph, directed=False)[1]


def _edges_within(surface: Surface, chosen: np.ndarray) -> np.ndarray:
    """Edges (e, 2) between the chosen points (k,), as indices into them."""
    place = np.full(len(surface.points), -1)
    place[chosen] = np.arange(len(chosen))
    edges = place[surface.edges]
    return edges[(edges >= 0).all(axis=1)]


def _surroundings(surface: Surface, own: np.ndarray, hops: int) -> np.ndarray:
    """Indices of `own` and of what is at most `hops` edges away without a sharp turn."""
    inside = np.zeros(len(surface.points), bool)
    inside[own] = True
    smooth = surface.edges[surface.turns > _LEVEL]
    for _ in range(hops):
        inside[smooth[inside[smooth].any(axis=1)]] = True
    return np.flatnonzero(inside)


def _halves(surface: Surface, own: np.ndarray) -> list[np.ndarray]:
    """Cut a set of points that does not lie flat in two, by where their normals point."""
    normals = surface.normals[own]
    edges = _edges_within(surface, own)
    i, j = np.concatenate([edges, edges[:, ::-1]]).T
    one = normals[np.argmin(normals @ normals.mean(axis=0))]
    other = normals[np.argmin(normals @ one)]
    if one @ other > 0.5:  # bent without turning far: cut across its length
        offset = surface.points[own] - surface.points[own].mean(axis=0)
        side = offset @ np.linalg.svd(offset, full_matrices=False)[2][0] > 0.0
    else:
        for _ in range(10):
            side = normals @ (one - other) > 0.0
            one, other = (
                unit_vectors(normals[side].mean(axis=0)),
                unit_vectors(normals[~side].mean(axis=0)),
            )
        for _ in range(4):  # the seam follows neighbourhoods, not single points
            vote = 2.0 * side - 1.0
            side = vote + np.bincount(i, vote[j], len(own)) > 0.0
        for half in (True, False):  # scraps go to the other side
            part = _components_of(edges[(side[edges] == half).all(axis=1)], len(own))
            small = np.bincount(part)[part] < max(12, _SCRAP * len(own))
            side = side ^ (small & (side == half))
    return [part for half in (own[side], own[~side]) for part in _components(surface, half)]
