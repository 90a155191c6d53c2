"""Offset, drag and edge contact: a tool beside its contact, along the normal or the travel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from nrdf.geometry.frames import frames_from_z_and_x
from nrdf.toolpath.frames import tilt_rotation, travel_directions
from nrdf.toolpath.surface_path import SurfacePath
from nrdf.toolpath.types import Segment


def offset(paths: Sequence[SurfacePath], offset_m: float) -> list[SurfacePath]:
    """Paths `offset_m` away from the surface, along its outward normal; below 0: into it."""
    return [
        replace(path, contacts=path.contacts + offset_m * path.normals) if offset_m else path
        for path in paths
    ]


def drag(paths: Sequence[SurfacePath], drag_m: float, smooth_m: float = 0.0) -> list[SurfacePath]:
    """Paths of a tool whose centre runs `drag_m` ahead of its contact, along the travel.

    What trails behind the centre (a brush's hair, a blade) then touches where the path was. The
    travel is averaged over `smooth_m` to either side, so that corners are rounded.
    """
    moved = []
    for path in paths:
        if not drag_m or len(path.contacts) < 2:
            moved.append(path)
            continue
        travel = travel_directions(path.contacts, smooth_m)
        ahead = frames_from_z_and_x(-path.normals, travel)[:, :, 0]
        moved.append(replace(path, contacts=path.contacts + drag_m * ahead))
    return moved


def edge_contact(
    segments: Sequence[Segment], radius_m: float, lead_rad: float, tilt_rad: float
) -> list[Segment]:
    """Segments of a disc whose edge, `radius_m` from the tool centre point, touches where that was.

    lead_rad, tilt_rad: of the segments' tools, as of `nrdf.toolpath.frames.tilt_rotation`. Of an
    upright disc no edge is lower than another: it stays.
    """
    away = edge_offset(radius_m, lead_rad, tilt_rad)
    if not away.any():
        return list(segments)
    return [
        replace(s, positions=s.positions + Rotation.from_quat(s.quaternions_xyzw).apply(away))
        for s in segments
    ]


def edge_offset(radius_m: float, lead_rad: float, tilt_rad: float) -> np.ndarray:
    """From where a tilted disc's edge touches to its centre, (3,), m, in the tool's frame."""
    outward = tilt_rotation(lead_rad, tilt_rad).inv().apply([0.0, 0.0, -1.0])
    flat = outward * [1.0, 1.0, 0.0]
    length = float(np.linalg.norm(flat))
    return np.zeros(3) if length < 1e-9 else np.asarray(radius_m * flat / length)
