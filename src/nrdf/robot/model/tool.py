"""The tool in the arm's hand: a force sensor, a neck, and a round end that works the surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from nrdf.robot.model.spheres import FINE, Spheres, cover_capsule, cover_cylinder
from nrdf.toolpath.types import ToolPath

BEND_RAD, SHAFT_M, NECK_M = np.radians(60.0), 0.20, 0.10
"""The default tool: a shaft, then a neck bent by that angle up to the tool centre point. Where the
knowledge file gives the tool's `tcp_m`, that counts instead. A bent neck can be turned away from
what stands beside the surface."""
PAD_GIVE_M = 0.002
"""How far the pad gives at the commanded force: its stiffness is the force by that."""
PAD_M = 0.020
"""Thickness of the soft end that presses on the surface; what is behind it must touch nothing."""
_SENSOR_RADIUS, _SENSOR_LENGTH = 0.0375, 0.04
_HOLDER_LENGTH, _HOLDER_SHARE, _NECK_SHARE, _THINNEST = 0.010, 0.4, 0.4, 0.005
_SHAFT_SHARE = 1.5  # of the neck's radius, between sensor and bend
_NOZZLE_RADIUS = 0.010
_MAX_TILT_RAD, _NOZZLE_TILT_RAD = np.radians(15.0), np.radians(10.0)


@dataclass(frozen=True)
class Part:
    """A capsule from start (3,) to end (3,), or with `flat` a cylinder, in the tool frame; m."""

    name: str
    start: np.ndarray
    end: np.ndarray
    radius: float
    flat: bool = False
    touches: bool = False


@dataclass(frozen=True)
class Tool:
    """A tool in the frame of the arm's tool frame (its flange).

    T_flange_tcp: (4, 4), of the tool centre point, z into the part. radius_m: of what works the
    surface. presses: whether it touches the surface at all. load: its mass, kg, and the place of
    its centre (3,), where they are known; else they follow from its parts.
    """

    name: str
    radius_m: float
    T_flange_tcp: np.ndarray
    presses: bool
    parts: tuple[Part, ...]
    load: tuple[float, tuple[float, float, float]] | None = None

    @property
    def max_tilt_rad(self) -> float:
        """The largest tilt of the tool axis from the planned one, where that is blocked.

        For a pad as far as it gives at the rim, so that its whole face still presses.
        """
        if not self.presses:
            return _NOZZLE_TILT_RAD
        return min(float(np.arcsin(min(PAD_GIVE_M / self.radius_m, 1.0))), _MAX_TILT_RAD)

    def spheres(self, link: int, T_link_flange: np.ndarray, step: float = FINE) -> Spheres:
        """Spheres around everything that must touch nothing, `step` radii apart."""
        made = Spheres.none()
        for part in self.parts:
            if part.touches:
                continue
            if part.flat:
                along = part.end - part.start
                half = 0.5 * float(np.linalg.norm(along))
                centres, radius = cover_cylinder(part.radius, half, step)
                rotation = _rotation_from_z(along)
                centres = centres @ rotation.T + 0.5 * (part.start + part.end)
            else:
                centres, radius = cover_capsule(part.start, part.end, part.radius, step)
            centres = centres @ T_link_flange[:3, :3].T + T_link_flange[:3, 3]
            links = np.full(len(centres), link)
            made += Spheres(centres, np.full(len(centres), radius), links)
        return made


def tool_of(path: ToolPath) -> Tool:
    """The tool of a tool path: round, as wide as its footprint where it presses, else a nozzle."""
    presses = any(segment.force_n is not None for segment in path.segments)
    T_flange_tcp = np.eye(4)
    T_flange_tcp[:3, :3] = Rotation.from_euler("y", BEND_RAD).as_matrix()
    T_flange_tcp[:3, 3] = NECK_M * T_flange_tcp[:3, 2] + [0.0, 0.0, SHAFT_M]
    if path.tcp_m is not None:
        T_flange_tcp = np.eye(4)
        T_flange_tcp[:3, 3] = path.tcp_m
    if path.tcp_quaternion_xyzw is not None:
        T_flange_tcp[:3, :3] = Rotation.from_quat(path.tcp_quaternion_xyzw).as_matrix()
    parts = _parts(T_flange_tcp, path.tool_radius_m, presses)
    return Tool(path.tool, path.tool_radius_m, T_flange_tcp, presses, parts)


def _parts(T_flange_tcp: np.ndarray, radius: float, presses: bool) -> tuple[Part, ...]:
    tip, axis = T_flange_tcp[:3, 3], T_flange_tcp[:3, 2]
    front = np.array([0.0, 0.0, _SENSOR_LENGTH])
    bend = tip - min(NECK_M, 0.5 * float(np.linalg.norm(tip - front))) * axis
    sensor = Part("force sensor", np.zeros(3), front, _SENSOR_RADIUS, flat=True)
    neck = max(_NECK_SHARE * radius, _THINNEST) if presses else _NOZZLE_RADIUS
    shaft = Part("shaft", front, bend, _SHAFT_SHARE * neck)
    if not presses:
        return sensor, shaft, Part("nozzle", bend, tip - neck * axis, neck)
    pad, holder = tip - PAD_M * axis, tip - (PAD_M + _HOLDER_LENGTH) * axis
    return (
        sensor,
        shaft,
        Part("neck", bend, holder, neck),
        Part("holder", holder, pad, max(_HOLDER_SHARE * radius, _THINNEST), flat=True),
        Part("pad", pad, tip, radius, flat=True, touches=True),
    )


def _rotation_from_z(direction: np.ndarray) -> np.ndarray:
    """A rotation (3, 3) that takes z to a direction (3,)."""
    along = direction / np.linalg.norm(direction)
    helper = np.eye(3)[int(np.argmin(np.abs(along)))]
    first = np.cross(helper, along)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(along, first), along], axis=1)
