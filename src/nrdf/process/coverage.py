"""How well a tool path works its region: the figures of the report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from nrdf.errors import ProcessError
from nrdf.process.frames import lean_rotation, surface_frames, travel_of
from nrdf.process.patch import inside_margin, patches_of
from nrdf.process.plan import Strategy
from nrdf.process.room import with_room
from nrdf.process.surface import Surface
from nrdf.process.toolpath import Segment
from nrdf.process.track import Track, line_spacing


@dataclass(frozen=True)
class Measures:
    """Figures of one tool path on one region.

    left_out: share [0, 1] of the region that has no room for the tool, and is no part of what
    follows. coverage: share of the region's area inside its margin that the footprint reaches;
    overlap: share of what is reached that it reaches more than once in a pass;
    line_spacing_*: between neighbouring lines, along the surface; None where no line has a
    neighbour. surface_distance_*: of the process waypoints from the local smooth surface at the
    stand-off asked for, the worst and the 99th percentile; axis_error_99_rad: 99th percentile of
    the angle between the tool's axis and the one asked for. process_length_m: of the process
    segments; path_length_m: of all, free moves between them included; cycle_time_s: at the feeds
    given, dwells included.
    """

    left_out: float
    coverage: float
    overlap: float
    line_spacing_mean_m: float | None
    line_spacing_worst_m: float | None
    surface_distance_worst_m: float
    surface_distance_99_m: float
    axis_error_99_rad: float
    path_length_m: float
    process_length_m: float
    cycle_time_s: float


def measure(
    surface: Surface, region: np.ndarray, strategy: Strategy, segments: Sequence[Segment]
) -> Measures:
    """Figures of `segments` on `region`, indices (k,) of the surface's points.

    The region's points, each of which stands for the same area, tell what is covered. Raises
    ProcessError if there is no process segment.
    """
    work = [segment for segment in segments if segment.kind == "process"]
    if not work:
        raise ProcessError("a tool path without a process segment cannot be measured")
    whole = len(surface.indices(region))
    region = with_room(surface, region, strategy.clearance_m)
    patches = patches_of(surface, region)
    axes = [_axes(segment) for segment in work]
    contacts = [
        s.positions + strategy.standoff_m * axis for s, axis in zip(work, axes, strict=True)
    ]
    once = len(work) // strategy.passes if len(work) % strategy.passes == 0 else len(work)
    track = Track.along(
        contacts[:once], axes[:once], strategy.tool_radius_m / 4.0, 0.5 * strategy.stepover_m
    )
    inside = inside_margin(surface, region, patches, strategy.edge_margin_m)
    visits = track.visits(surface.points[inside], surface.normals[inside], strategy.tool_radius_m)
    spacing = line_spacing(patches, track, strategy.stepover_m).distance
    off, wrong = _fit(surface, strategy, work, contacts)
    process, between, time = _driven(segments, strategy.approach_feed_m_s)
    return Measures(
        left_out=1.0 - len(surface.indices(region)) / whole,
        coverage=float((visits > 0).mean()) if len(visits) else 0.0,
        overlap=float((visits[visits > 0] > 1).mean()) if (visits > 0).any() else 0.0,
        line_spacing_mean_m=float(spacing.mean()) if len(spacing) else None,
        line_spacing_worst_m=float(spacing.max()) if len(spacing) else None,
        surface_distance_worst_m=float(off.max()),
        surface_distance_99_m=float(np.quantile(off, 0.99)),
        axis_error_99_rad=float(np.quantile(wrong, 0.99)),
        path_length_m=process + between,
        process_length_m=process,
        cycle_time_s=time,
    )


def _axes(segment: Segment) -> np.ndarray:
    """Tool z (n, 3) of a segment."""
    return Rotation.from_quat(segment.quaternions_xyzw).as_matrix()[:, :, 2]


def _fit(
    surface: Surface,
    strategy: Strategy,
    work: Sequence[Segment],
    contacts: Sequence[np.ndarray],
) -> tuple[np.ndarray, np.ndarray]:
    """Of every waypoint, the distance (n,), m, from the smooth surface that faces the tool, and
    the angle (n,), rad, between tool z and what the strategy asks for on smooth normals."""
    everywhere = np.concatenate(contacts)
    held = Rotation.from_quat(np.concatenate([segment.quaternions_xyzw for segment in work]))
    lean = lean_rotation(strategy.lead_rad, strategy.tilt_rad)
    tails = -(held * lean.inv()).as_matrix()[:, :, 2]
    _, _, off = surface.nearest(everywhere, tails)
    off = np.minimum(off, surface.tree.query(everywhere)[0])  # the cloud, where it is no surface
    smooth = surface.smooth_normals(everywhere, tails, strategy.tool_radius_m)
    asked = []
    cuts = np.cumsum([len(line) for line in contacts])[:-1]
    for line, normals in zip(contacts, np.split(smooth, cuts), strict=True):
        # A waypoint alone has no travel; for a tool that does not lean, any will do.
        travel = travel_of(line, 0.5 * strategy.stepover_m) if len(line) > 1 else np.ones((1, 3))
        asked.append(surface_frames(travel, normals))
    axes = (Rotation.from_matrix(np.concatenate(asked)) * lean).as_matrix()[:, :, 2]
    cosine = np.einsum("na,na->n", axes, held.as_matrix()[:, :, 2])
    return off, np.arccos(np.clip(cosine, -1.0, 1.0))


def _driven(segments: Sequence[Segment], free_feed: float) -> tuple[float, float, float]:
    """Length of process segments, length of everything else, time of all."""
    process, between, time = 0.0, 0.0, 0.0
    end = None
    for segment in segments:
        if end is not None:
            free = float(np.linalg.norm(segment.positions[0] - end))
            between, time = between + free, time + free / free_feed
        length = float(np.linalg.norm(np.diff(segment.positions, axis=0), axis=1).sum())
        time += length / segment.feed_m_s + segment.dwell_s
        if segment.kind == "process":
            process += length
        else:
            between += length
        end = segment.positions[-1]
    return process, between, time
