"""Where a tool's body would touch the object: a cylinder that stands back from the tool's tip."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nrdf.errors import ProcessError
from nrdf.geometry.frames import tangent_frames
from nrdf.geometry.polylines import arc_length
from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.target_mesh import TargetMesh
from nrdf.surface.tool_clearance import region_where
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.types import Segment

_ABOVE = 0.15  # of the radius: so far from the tip, at least, the body is looked at
_DEEPEST_M = 2e-3  # less is what a pad gives
_AROUND, _MOST_HEIGHTS = 12, 12  # directions that are looked in, and heights
_STEP = 0.5  # of the body's radius: between places, and between heights


def body_touches(
    surface: TargetMesh,
    positions: np.ndarray,
    axes: np.ndarray,
    radius_m: float,
    length_m: float,
) -> np.ndarray:
    """At which (n,) tool centre points (n, 3), m, with tool z at axes (n, 3), the tool's body meets
    a surface.

    The body is a cylinder of radius_m that reaches back from the tip by length_m. What is within a
    seventh of its radius from the tip does not count, so that a disc may lie on a curved surface.
    Where something stands in its way is looked for along its axis, and outward from it.
    """
    if not len(positions) or radius_m <= 0.0 or length_m <= 0.0:
        return np.zeros(len(positions), bool)
    low = min(_ABOVE * radius_m + _DEEPEST_M, length_m)
    count = int(np.clip(np.ceil((length_m - low) / (_STEP * radius_m)), 1, _MOST_HEIGHTS))
    heights = np.linspace(low, length_m, count + 1)
    back = -np.asarray(axes, dtype=np.float64)
    starts = positions + low * back
    touched = surface.first_hits(starts, back)[0] < length_m - low
    angle = 2.0 * np.pi * np.arange(_AROUND) / _AROUND
    frames = tangent_frames(back)
    outward = (
        np.cos(angle)[:, None] * frames[:, None, 0] + np.sin(angle)[:, None] * frames[:, None, 1]
    )
    for height in heights:
        left = np.flatnonzero(~touched)
        on_axis = np.repeat(positions[left] + height * back[left], _AROUND, axis=0)
        far = surface.first_hits(on_axis, outward[left].reshape(-1, 3))[0]
        touched[left] = far.reshape(-1, _AROUND).min(axis=1) < radius_m - _DEEPEST_M
    return touched


def region_clear_of_body(region: RegionMesh, strategy: Strategy) -> RegionMesh:
    """A region without the places at which the tool's body would touch the object.

    Looked at with the tool along the normal, without lead and tilt. Lines then end a body's radius
    before a wall, and the footprint may reach on to it. Whole for a tool whose body is not known.
    Raises ProcessError where that leaves nothing.
    """
    radius, length = strategy.body_radius_m, strategy.body_length_m
    if radius <= 0.0 or length <= 0.0:
        return region

    def free(points: np.ndarray, outward: np.ndarray) -> np.ndarray:
        tips = points + strategy.standoff_m * outward
        return ~body_touches(region.parent, tips, -outward, radius, length)

    found = region_where(region, free, strategy.tool_radius_m)
    if found is None:
        raise ProcessError(
            f"the tool's body, {1e3 * radius:g} mm in radius and {1e3 * length:g} mm long, would "
            "touch the object everywhere in the region; give the tool that fits, or leave "
            "body_length_m out"
        )
    return found


def touching_places(
    segments: Sequence[Segment], surface: TargetMesh, radius_m: float, length_m: float
) -> tuple[np.ndarray, float]:
    """Places (k, 3), m, of the tool centre point on process segments at which the tool's body
    meets a surface, and their share of all that were looked at, half a radius apart."""
    places, axes = [np.zeros((0, 3))], [np.zeros((0, 3))]
    for segment in segments:
        if segment.kind != "process":
            continue
        along = arc_length(segment.positions)
        at = np.arange(0.0, along[-1] + 1e-9, max(_STEP * radius_m, 1e-4))
        picked = np.unique(np.minimum(np.searchsorted(along, at), len(along) - 1))
        places.append(segment.positions[picked])
        axes.append(segment.axes[picked])
    place, axis = np.concatenate(places), np.concatenate(axes)
    touched = body_touches(surface, place, axis, radius_m, length_m)
    return place[touched], float(touched.mean()) if len(touched) else 0.0
