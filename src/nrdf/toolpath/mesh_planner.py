"""From a strategy and a region of the object's mesh to the segments that a robot drives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.target_mesh import TargetMesh
from nrdf.surface.tool_clearance import accessible_region
from nrdf.toolpath.line_direction import line_axes, with_direction
from nrdf.toolpath.modifiers import (
    chord_error,
    constant_speed,
    drag,
    edge_contact,
    join,
    largest_step,
    minimum_length,
    offset,
    one_way,
    order_nearest,
    order_shortest,
    run_off,
    smooth_orientation,
    split,
    start_at,
    steady_normals,
)
from nrdf.toolpath.modifiers.join import Project
from nrdf.toolpath.modifiers.one_way import begun_near
from nrdf.toolpath.modifiers.order import Lift, way_between
from nrdf.toolpath.modifiers.run_off import Free
from nrdf.toolpath.planners import PLANNERS, Planner
from nrdf.toolpath.region_samples import sample_evenly
from nrdf.toolpath.size_limits import check_passes, check_size
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.surface_path import SurfacePath
from nrdf.toolpath.tool_body import region_clear_of_body
from nrdf.toolpath.tool_segments import (
    add_approach_retract,
    contact_points,
    fewer_waypoints,
    steady_tool_segments,
    with_edges,
)
from nrdf.toolpath.types import Segment

_LARGEST_STEP = 2.0  # spacings inside a line
_PER_RADIUS = 4.0  # samples of a region along the tool's radius
_NEEDED, _LOST = 0.02, 0.001
"""Shares of a region that a short line must reach alone to stay, and that all that go may have
reached alone."""
_TOUCHES = 1e-3  # m into the object that a run-off may be: meshes are faceted
_LIFT, _WALL = 0.1, 0.5  # of the radius, where walls are looked for; cosine to one's normal


def plan_on_mesh(
    region: RegionMesh, strategy: Strategy, planner: Planner | None = None
) -> tuple[Segment, ...]:
    """Segments that work a region, in driving order; every contact is on the object's triangles.

    Only run-off, offset, drag and edge contact, where the strategy has them, lead off them.
    planner: the one of `nrdf.toolpath.planners.PLANNERS` that the strategy names, unless given.
    Raises ProcessError for a margin, clearance or tool body that leaves nothing of the region, a
    stepover wider than it, a direction that stands on it, or more than
    `nrdf.toolpath.size_limits` allows.
    """
    region = accessible_region(region, strategy.clearance_m, strategy.tool_radius_m)
    region = region_clear_of_body(region, strategy)
    check_size(region, strategy)
    strategy = with_direction(region, strategy)
    make = PLANNERS[strategy.trajectory] if planner is None else planner
    paths = modified(make(region, strategy), region, strategy)
    waypoints = sum(len(path.contacts) for path in paths)
    check_passes(waypoints, len(paths), strategy.passes)
    passes = [
        paths if index % 2 == 0 else [path.reversed() for path in reversed(paths)]
        for index in range(strategy.passes)
    ]
    lines, normals = steady_tool_segments([path for once in passes for path in once], strategy)
    lines = edge_contact(lines, strategy.edge_contact_m, strategy.lead_rad, strategy.tilt_rad)
    if strategy.run_off_m > 0.0:
        lines = with_edges(lines, strategy, region.parent)
    if strategy.resample_step_m > 0.0:
        lines, normals = fewer_waypoints(lines, normals, strategy)
    if strategy.constant_speed:
        lines = constant_speed(lines, [contact_points(line, strategy) for line in lines])
    return add_approach_retract(lines, normals, replace(strategy, passes=1))


def modified(
    paths: Sequence[SurfacePath], region: RegionMesh, strategy: Strategy
) -> list[SurfacePath]:
    """A planner's paths, put through the modifiers as the strategy says, one after another."""
    project, step = _projection(region, strategy), _LARGEST_STEP * strategy.spacing_m
    turn, spacing, radius = strategy.largest_turn_rad_m, strategy.spacing_m, strategy.tool_radius_m
    paths = smooth_orientation(split(paths, step), turn)
    paths = steady_normals(paths, strategy.steady_m)
    points, faces = sample_evenly(region.mesh, radius / _PER_RADIUS)
    outward = region.mesh.face_normals[faces]
    paths = minimum_length(
        paths, strategy.least_line_m, points, outward, radius, needed=_NEEDED, lost=_LOST
    )
    paths = chord_error(paths, project, strategy.chord_error_m)
    paths = _rows_in_order(paths, region, strategy, project)
    free = _free(region.parent, radius)
    paths = run_off(paths, strategy.run_off_m, spacing, strategy.run_off_height_m, free)
    if strategy.joined_gap_m > 0.0:
        # Lines that run off the part are joined off it.
        way = project if strategy.run_off_m == 0.0 else _straight
        joined = join(paths, way, spacing, strategy.joined_gap_m, may_turn=_may_turn(strategy))
        paths = _sequence(smooth_orientation(split(joined, step), turn), strategy)
    height = strategy.standoff_m + strategy.offset_m
    paths = largest_step(paths, project, height, step)
    dragged = drag(paths, strategy.drag_m, 0.5 * strategy.stepover_m)
    return offset(dragged, strategy.offset_m)


def _rows_in_order(
    paths: Sequence[SurfacePath], region: RegionMesh, strategy: Strategy, project: Project
) -> list[SurfacePath]:
    """Paths in order: as they are, or joined row by row first where fewer lifts come of it.

    Lines that run off the part, or all one way, are joined later, or not.
    """
    ordered = in_order(paths, region, strategy)
    gap, spacing = strategy.joined_gap_m, strategy.spacing_m
    if gap <= 0.0 or strategy.run_off_m > 0.0 or not _may_turn(strategy):
        return ordered
    tries = [join(ordered, project, spacing, gap)]
    if strategy.line_order == "nearest":
        return tries[0]
    rows = join(paths, project, spacing, gap)
    if len(rows) < len(paths):
        tries.append(join(in_order(rows, region, strategy), project, spacing, gap))
    return min(tries, key=lambda made: (len(made), way_between(made, _lift(strategy))))


def in_order(
    paths: Sequence[SurfacePath], region: RegionMesh, strategy: Strategy
) -> list[SurfacePath]:
    """Paths in the strategy's order, from its start on, with short ways between them.

    From the outside in, or from the inside out, planners' order stays: no ring comes before one
    that is farther out, or in.
    """
    one = strategy.line_order == "one-way"
    along, left = line_axes(region, strategy)
    if strategy.start == "inside":
        # Planners make rings and spirals from the outside in.
        paths = [path.reversed() for path in reversed(paths)]
    if one:
        paths = [
            path if strategy.in_rings and not path.closed else one_way([path], along)[0]
            for path in paths
        ]
    if strategy.in_rings:
        return begun_near(paths)
    if strategy.start is not None:
        towards = along if strategy.start.startswith("far") else -along
        towards = towards + (left if strategy.start.endswith("left") else -left)
        paths = start_at(paths, towards, may_turn=not one)
    return _sequence(paths, strategy)


def _sequence(paths: Sequence[SurfacePath], strategy: Strategy) -> list[SurfacePath]:
    """Paths in the order that the strategy asks for, the first one first."""
    if strategy.in_rings:
        return list(paths)
    make = order_nearest if strategy.line_order == "nearest" else order_shortest
    return make(paths, strategy.line_order == "one-way", _lift(strategy))


def _may_turn(strategy: Strategy) -> bool:
    """Whether lines may be driven from either end, in any order."""
    return strategy.line_order != "one-way" and not strategy.in_rings


def _lift(strategy: Strategy) -> Lift:
    height = max(strategy.retract_distance_m, strategy.tool_radius_m)
    return Lift(height, strategy.joined_gap_m)


def _projection(region: RegionMesh, strategy: Strategy) -> Project:
    """To the region's nearest places of the same side, with normals as of the whole object."""

    def project(
        points: np.ndarray, normals: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        found = region.mesh.nearest(points, normals)
        faces = region.parent.nearest(found.points, found.normals).faces
        smooth = region.felt_normals(found.points, faces, strategy.tool_radius_m)
        return found.points, smooth, found.distances < strategy.tool_radius_m

    return project


def _straight(points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return points, normals, np.ones(len(points), bool)


def _free(target: TargetMesh, radius_m: float) -> Free:
    """Beyond a line's end the tool may go where it is not in the object, with no wall ahead within
    its radius."""

    def free(points: np.ndarray, travel: np.ndarray, normals: np.ndarray) -> np.ndarray:
        found = target.nearest(points)
        height = np.einsum("na,na->n", points - found.points, found.normals)
        lifted = points + _LIFT * radius_m * normals
        distance, face = target.first_hits(lifted, travel)
        against = np.einsum("na,na->n", target.face_normals[face], travel) < -_WALL
        return (height > -_TOUCHES) & ~((distance < radius_m) & against)

    return free
