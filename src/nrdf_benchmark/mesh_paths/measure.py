"""Figures of a tool path against the mesh that was given, never the surface it was planned on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import pairwise

import igl
import numpy as np
from scipy.spatial import cKDTree

from nrdf.geometry.polylines import step_lengths
from nrdf.surface.given_surface import MeshSurface
from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.target_mesh import TargetMesh
from nrdf.surface.tool_clearance import has_clearance, needed_clearance
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.types import Segment
from nrdf_benchmark.mesh_paths.line_spacing import ALIKE, Line, Surface, line_spacing
from nrdf_benchmark.mesh_paths.region_shape import RegionMatch, is_curved, parts_in_space
from nrdf_benchmark.mesh_paths.targets import MeshTarget, face_components

_LEAST_STEP_M = 1e-4  # that a turn is divided by
_FITS = 0.8  # share of a disc that lies on a region which the footprint fits into
_BESIDE, _STEP = 0.1, 0.25
"""Stepovers that a place between two lines may be beside the region, and over or under it."""
_ASKED = 400  # points at which a region is asked for room


@dataclass(frozen=True)
class MeshPathMetrics:
    """One region's tool path. Lengths in m, angles in rad.

    distance_99_m, distance_worst_m: of contact points from the given triangles. step_worst: largest
    step inside a stroke, in spacings; steps_above: how many are above 2. turn_worst_rad_m: largest
    turn of the axis for each m of the way. coverage: share within the footprint of
    what should be worked: the region's visible points that were planned on and that the tool can
    access. spacing_even: share of places whose neighbouring lines are 0.85 to 1.15 stepovers
    apart, and spacing_worst the farthest, in stepovers; None where no line has a neighbour.
    strokes: process segments; stroke_ratio: median of their length over the region's extent along
    them; short_strokes: shorter than the tool's radius; needless_strokes: those of them that cover
    less than 2 % of the region. surface_m, air_m: way on the surface, and off it.
    fits: whether the footprint fits into the region somewhere. area_m2: of the visible region.
    parts: its parts, in space, that are no smaller than the footprint, at least 1. curved: whether
    its sides bend under the tool. Shares of all of it: left_out, without a stroke outside the
    region that was planned on; no_clearance, where no tool gets to
    (`nrdf.surface.tool_clearance.needed_clearance`); unreached, what should be worked and is not.
    border_ratio: length of the border that was planned with, for that of the given region; iou: of
    the two regions; None where they are one.
    """

    distance_99_m: float
    distance_worst_m: float
    step_worst: float
    steps_above: int
    turn_worst_rad_m: float
    coverage: float
    spacing_even: float | None
    spacing_worst: float | None
    strokes: int
    stroke_ratio: float
    short_strokes: int
    needless_strokes: int
    surface_m: float
    air_m: float
    fits: bool
    area_m2: float
    parts: int = 1
    curved: bool = False
    left_out: float = 0.0
    no_clearance: float = 0.0
    unreached: float = 0.0
    border_ratio: float | None = None
    iou: float | None = None

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """The figures' names."""
        return tuple(field.name for field in fields(cls))


def measure_mesh_path(
    target: MeshTarget,
    region: str,
    segments: Sequence[Segment],
    strategy: Strategy,
    planned: RegionMesh | None = None,
) -> MeshPathMetrics:
    """Measure what a planner made of one region; at least one process segment.

    planned: the region that was planned on, where it was found, and not given.
    """
    radius = strategy.tool_radius_m
    work = [segment for segment in segments if segment.kind == "process"]
    contacts = [s.positions + strategy.standoff_m * s.axes for s in work]
    axes = [s.axes for s in work]
    given = MeshSurface(target.vertices, target.faces)
    distance = given.distance(np.concatenate(contacts), np.concatenate(axes))
    steps = [step_lengths(line) for line in contacts]
    every_step = np.concatenate([*steps, np.zeros(1)])
    turns = [_turns(a) / np.maximum(s, _LEAST_STEP_M) for a, s in zip(axes, steps, strict=True)]
    lines = [Line.of(c, a, strategy) for c, a in zip(contacts, axes, strict=True)]
    indices = target.indices(region)
    points, normals = target.skin.points[indices], target.skin.normals[indices]
    covered = [_covered(points, normals, line, radius) for line in lines]
    lengths = np.array([float(step.sum()) for step in steps])
    short = lengths < radius
    shares = np.array([len(one) for one in covered]) / len(points)
    reached = np.zeros(len(points), bool)
    reached[np.concatenate(covered)] = True
    found = RegionMatch.of(target, region, planned)
    room = has_clearance(
        target.given_mesh, points, normals, needed_clearance(strategy.clearance_m, radius)
    )
    wanted = found.inside & room
    surface = _surface_of(target, region, strategy)
    apart = line_spacing(lines, strategy.stepover_m, surface) / strategy.stepover_m
    return MeshPathMetrics(
        distance_99_m=float(np.quantile(distance, 0.99)),
        distance_worst_m=float(distance.max()),
        step_worst=float(every_step.max() / strategy.spacing_m),
        steps_above=int((every_step > 2.0 * strategy.spacing_m).sum()),
        turn_worst_rad_m=float(np.concatenate([*turns, np.zeros(1)]).max()),
        coverage=float(reached[wanted].mean()) if wanted.any() else 1.0,
        spacing_even=float(((apart >= 0.85) & (apart <= 1.15)).mean()) if len(apart) else None,
        spacing_worst=float(apart.max()) if len(apart) else None,
        strokes=len(work),
        stroke_ratio=float(np.median(lengths / _extents(target, region, contacts))),
        short_strokes=int(short.sum()),
        needless_strokes=int((short & (shares < 0.02)).sum()),
        surface_m=float(lengths.sum()),
        air_m=_air(segments),
        fits=footprint_fits(target, region, radius),
        area_m2=len(points) * target.point_area_m2,
        parts=parts_in_space(points, target.point_area_m2, radius),
        curved=is_curved(points, normals, radius),
        left_out=float((~found.inside & room & ~reached).mean()),
        no_clearance=float((~room).mean()),
        unreached=float((wanted & ~reached).mean()),
        border_ratio=found.border_ratio,
        iou=found.iou,
    )


def _surface_of(target: MeshTarget, region: str, strategy: Strategy) -> Surface:
    """Whether the given region is at places, and a tool can access it there."""
    own = TargetMesh(target.vertices, target.faces[target.regions[region]])
    needed = needed_clearance(strategy.clearance_m, strategy.tool_radius_m)

    def surface(places: np.ndarray, outward: np.ndarray) -> np.ndarray:
        found = own.nearest(places, outward)
        off = found.points - places
        sideways = off - np.einsum("ma,ma->m", off, outward)[:, None] * outward
        there = np.linalg.norm(sideways, axis=1) < _BESIDE * strategy.stepover_m
        there &= found.distances < _STEP * strategy.stepover_m
        asked = np.flatnonzero(there)
        there[asked] = has_clearance(
            target.given_mesh, found.points[asked], found.normals[asked], needed
        )
        return there

    return surface


def footprint_fits(target: MeshTarget, region: str, radius_m: float) -> bool:
    """Whether a disc of that radius lies on the region somewhere, for the most part."""
    indices = target.indices(region)
    points, normals = target.skin.points[indices], target.skin.normals[indices]
    wanted = _FITS * np.pi * radius_m**2 / target.point_area_m2
    asked = np.unique(np.linspace(0, len(points) - 1, _ASKED).astype(int))
    for k, near in zip(
        asked, cKDTree(points).query_ball_point(points[asked], radius_m), strict=True
    ):
        if (normals[near] @ normals[k] > ALIKE).sum() >= wanted:
            return True
    return False


def _covered(points: np.ndarray, normals: np.ndarray, line: Line, radius_m: float) -> np.ndarray:
    """Which of points (n, 3) a stroke's footprint passes over: indices (k,)."""
    away, near = cKDTree(line.points).query(points, 12, distance_upper_bound=radius_m)
    there = np.isfinite(away)
    facing = line.normals[np.where(there, near, 0)]
    alike = np.einsum("nka,na->nk", facing, normals) > ALIKE
    return np.flatnonzero((there & alike).any(axis=1))


def _extents(target: MeshTarget, region: str, contacts: Sequence[np.ndarray]) -> np.ndarray:
    """How long (s,), m, the piece of the region that each stroke works is, along the stroke."""
    mask = target.regions[region]
    chosen = np.flatnonzero(mask)
    piece = face_components(target.faces, mask)
    tree = igl.AABB()
    vertices = np.ascontiguousarray(target.vertices)
    own = np.ascontiguousarray(target.faces[chosen])
    tree.init(vertices, own)
    middles = np.array([line[len(line) // 2] for line in contacts])
    at = np.atleast_1d(tree.squared_distance(vertices, own, middles)[1])
    extents = []
    for line, k in zip(contacts, piece[chosen[at]], strict=True):
        main = np.linalg.svd(line - line.mean(axis=0), full_matrices=False)[2][0]
        extents.append(np.ptp(vertices[target.faces[piece == k]].reshape(-1, 3) @ main))
    return np.maximum(extents, 1e-9)


def _turns(axes: np.ndarray) -> np.ndarray:
    """Angles (n - 1,), rad, between axes (n, 3) that follow each other."""
    cosine = np.einsum("na,na->n", axes[1:], axes[:-1])
    return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)))


def _air(segments: Sequence[Segment]) -> float:
    """The way off the surface, m: free segments, and straight from each segment to the next."""
    free = sum(float(step_lengths(s.positions).sum()) for s in segments if s.kind != "process")
    gaps = [
        float(np.linalg.norm(after.positions[0] - before.positions[-1]))
        for before, after in pairwise(segments)
    ]
    return free + sum(gaps)
