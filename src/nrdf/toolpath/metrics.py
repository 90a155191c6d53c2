"""How well a tool path works its region."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

from nrdf.errors import ProcessError
from nrdf.geometry.frames import angles_between
from nrdf.geometry.polylines import step_lengths, total_length
from nrdf.surface.given_surface import GivenSurface
from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.cycle_time import estimate_cycle_time
from nrdf.toolpath.frames import surface_frames, tilt_rotation, travel_directions
from nrdf.toolpath.line_spacing import line_spacing
from nrdf.toolpath.region_samples import RegionSamples
from nrdf.toolpath.sampled_path import SampledPath
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.tool_body import touching_places
from nrdf.toolpath.tool_segments import contact_points
from nrdf.toolpath.types import Segment

_SHORTEST_M = 1e-3
_COMPARED_M = 0.003  # between the places that are compared with the object as given


@dataclass(frozen=True)
class ToolPathMetrics:
    """Metrics of one tool path on one region.

    coverage, left_out, unreached: shares of the whole region that was found, as a `Coverage` has
    them; overlap: share of what is worked that is reached more than once in a pass;
    line_spacing_*: between neighbouring lines, along the surface; None where no line has a
    neighbour, and at a first look.

    surface_distance_*: of the process waypoints from the mesh that they were planned on, at the
    stand-off asked for, the worst and the 99th percentile. true_distance_*: of the places on the
    surface that are worked, along the lines and between waypoints too, from the object as it was
    given (`nrdf.surface.given_surface`), which compared_with names; distances below resolution_m
    mean nothing. None where it is not known. Waypoints off the surface, as of a run-off, are in
    neither.

    axis_error_99_rad: 99th percentile of the angle between the tool's axis and the one asked for.
    step_worst_m, turn_worst_rad, bend_worst_rad_m: the largest step between neighbouring waypoints
    of a process segment, of the tool centre point or of the place that it works, whichever is
    larger; the largest turn of the tool's axis between them; and the largest turn by length of the
    step, where steps of less than 1 mm count as 1 mm.

    body_touches: share of the places along process segments at which the tool's body would touch
    the object (`nrdf.toolpath.tool_body`), the first of them at body_touches_at_m; None where the
    body is not known.

    process_length_m: of the process segments; path_length_m: of all, free moves between them
    included; cycle_time_s: dwells included; of an arm
    (`nrdf.toolpath.cycle_time`) where it is known how the object stands, else at the feeds given.
    """

    coverage: float
    left_out: dict[str, float]
    unreached: float
    overlap: float
    line_spacing_mean_m: float | None
    line_spacing_worst_m: float | None
    surface_distance_worst_m: float
    surface_distance_99_m: float
    axis_error_99_rad: float
    step_worst_m: float
    turn_worst_rad: float
    bend_worst_rad_m: float
    path_length_m: float
    process_length_m: float
    cycle_time_s: float
    compared_with: str | None = None
    resolution_m: float | None = None
    true_distance_worst_m: float | None = None
    true_distance_99_m: float | None = None
    true_distance_95_m: float | None = None
    body_touches: float | None = None
    body_touches_at_m: tuple[float, float, float] | None = None


def measure_path(
    region: RegionMesh,
    strategy: Strategy,
    segments: Sequence[Segment],
    given: GivenSurface | None = None,
    up: np.ndarray | None = None,
) -> ToolPathMetrics:
    """Metrics of `segments` on a region of an object's mesh.

    Samples of the region, each of which stands for the same area, tell what is covered. given: the
    object itself, which the path is compared with. up: (3,) the object's upright axis, with
    which an arm's cycle time is estimated. Raises ProcessError where there is no process segment.
    """
    work = [segment for segment in segments if segment.kind == "process"]
    if not work:
        raise ProcessError("a tool path without a process segment cannot be measured")
    samples = RegionSamples.of(region, strategy)
    axes = [segment.axes for segment in work]
    contacts = [contact_points(segment, strategy) for segment in work]
    once = len(work) // strategy.passes if len(work) % strategy.passes == 0 else len(work)
    sampled = SampledPath.along(
        contacts[:once], axes[:once], strategy.tool_radius_m / 4.0, 0.5 * strategy.stepover_m
    )
    counts = sampled.coverage_count(samples.points, samples.normals, strategy.tool_radius_m)
    worked = counts[(counts > 0) & samples.accessible]
    spacing = np.zeros(0)
    if not region.rough:
        spacing = line_spacing(region.mesh, sampled, strategy.stepover_m)
    off, wrong = _fit(region, strategy, work, contacts)
    step, turn, bend = _jumps(work, contacts, axes)
    process, between, time = _driven(segments, strategy.approach_feed_m_s)
    if up is not None:
        time = estimate_cycle_time(segments, region.parent, strategy.tool_radius_m, up).total_s
    shares = samples.coverage(counts > 0)
    made = ToolPathMetrics(
        coverage=shares.worked,
        left_out=shares.left_out,
        unreached=shares.unreached,
        overlap=float((worked > 1).mean()) if len(worked) else 0.0,
        line_spacing_mean_m=float(spacing.mean()) if len(spacing) else None,
        line_spacing_worst_m=float(spacing.max()) if len(spacing) else None,
        surface_distance_worst_m=float(off.max()),
        surface_distance_99_m=float(np.quantile(off, 0.99)),
        axis_error_99_rad=float(np.quantile(wrong, 0.99)),
        step_worst_m=step,
        turn_worst_rad=turn,
        bend_worst_rad_m=bend,
        path_length_m=process + between,
        process_length_m=process,
        cycle_time_s=time,
    )
    if strategy.body_length_m > 0.0:
        touched, share_touched = touching_places(
            work, region.parent, strategy.body_radius_m, strategy.body_length_m
        )
        first = None if not len(touched) else (*touched[0].tolist(),)
        made = replace(made, body_touches=share_touched, body_touches_at_m=first)
    if given is None:
        return made
    runs = [(k, run) for k in range(once) for run in _on_surface(work[k])]
    fine = SampledPath.along(
        [contacts[k][run] for k, run in runs], [axes[k][run] for k, run in runs], _COMPARED_M, 0.0
    )
    away = given.distance(fine.places, fine.axes)
    return replace(
        made,
        compared_with=given.name,
        resolution_m=given.resolution_m,
        true_distance_worst_m=float(away.max()),
        true_distance_99_m=float(np.quantile(away, 0.99)),
        true_distance_95_m=float(np.quantile(away, 0.95)),
    )


def _jumps(
    work: Sequence[Segment], contacts: Sequence[np.ndarray], axes: Sequence[np.ndarray]
) -> tuple[float, float, float]:
    """The largest step (m), turn of the axis (rad) and turn by length (rad/m) of any segment."""
    step, turn, bend = 0.0, 0.0, 0.0
    for segment, line, axis in zip(work, contacts, axes, strict=True):
        if len(line) < 2:
            continue
        far = np.maximum(step_lengths(segment.positions), step_lengths(line))
        # Twice the arctangent of the chords' ratio: exact for small angles too.
        apart = step_lengths(axis)
        together = np.linalg.norm(axis[1:] + axis[:-1], axis=1)
        turned = 2.0 * np.arctan2(apart, together)
        step, turn = max(step, float(far.max())), max(turn, float(turned.max()))
        bend = max(bend, float((turned / np.maximum(far, _SHORTEST_M)).max()))
    return step, turn, bend


def _on_surface(segment: Segment) -> list[slice]:
    """The stretches of a process segment that are on the surface; all of it where none is."""
    over = segment.over_surface
    cuts = [0, *(np.flatnonzero(np.diff(over.astype(int))) + 1), len(over)]
    runs = [slice(a, b) for a, b in pairwise(cuts) if over[a]]
    return runs or [slice(None)]


def _fit(
    region: RegionMesh,
    strategy: Strategy,
    work: Sequence[Segment],
    contacts: Sequence[np.ndarray],
) -> tuple[np.ndarray, np.ndarray]:
    """Of every waypoint, the distance (n,), m, from the mesh that faces the tool, and the angle
    (n,), rad, between tool z and what the strategy asks for on smooth normals."""
    tilt = tilt_rotation(strategy.lead_rad, strategy.tilt_rad)
    runs = [(k, run) for k, segment in enumerate(work) for run in _on_surface(segment)]
    lines = [contacts[k][run] for k, run in runs]
    held = Rotation.from_quat(np.concatenate([work[k].quaternions_xyzw[run] for k, run in runs]))
    tails = -(held * tilt.inv()).as_matrix()[:, :, 2]
    nearest = region.parent.nearest(np.concatenate(lines), tails)
    smooth = region.felt_normals(nearest.points, nearest.faces, strategy.tool_radius_m)
    planned = []
    cuts = np.cumsum([len(line) for line in lines])[:-1]
    for line, normals in zip(lines, np.split(smooth, cuts), strict=True):
        # A waypoint alone has no travel; for a tool that is not tilted, any will do.
        travel = (
            travel_directions(line, 0.5 * strategy.stepover_m) if len(line) > 1 else np.ones((1, 3))
        )
        planned.append(surface_frames(travel, normals))
    axes = (Rotation.from_matrix(np.concatenate(planned)) * tilt).as_matrix()[:, :, 2]
    return nearest.distances, angles_between(axes, held.as_matrix()[:, :, 2])


def _driven(segments: Sequence[Segment], free_feed: float) -> tuple[float, float, float]:
    """Length of process segments, length of everything else, time of all."""
    process, between, time = 0.0, 0.0, 0.0
    end = None
    for segment in segments:
        if end is not None:
            free = float(np.linalg.norm(segment.positions[0] - end))
            between, time = between + free, time + free / free_feed
        length = total_length(segment.positions)
        time += segment.seconds + segment.dwell_s
        if segment.kind == "process":
            process += length
        else:
            between += length
        end = segment.positions[-1]
    return process, between, time
