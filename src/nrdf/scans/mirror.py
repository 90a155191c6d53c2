"""The plane that halves an object: chairs, cars and aircraft are alike on both sides of it.

Where both sides were seen it fixes yaw and sideways place far better than any comparison with other
objects of the kind can.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from nrdf.geometry.sampling import downsample

_ITERATIONS = 10
_POINTS = 700  # that are reflected
_NORMAL_WEIGHT = 0.1
_NEAR = 0.02  # canonical distance within which a reflected point has met its counterpart


@dataclass(frozen=True)
class MirrorPlane:
    """Points p with normal @ p = offset: normal (3,) level, to the right-hand side.

    agreement: share of the points whose reflection lies on the object too.
    """

    normal: np.ndarray
    offset: float
    agreement: float


def mirror_plane(
    points: np.ndarray, normals: np.ndarray, start: np.ndarray, turn: float = np.radians(12)
) -> MirrorPlane:
    """The upright mirror plane near the one through the middle of the points across `start`.

    points: (n, 3), +Y up, longest side about 1; normals: (n, 3) outward; start: (3,) unit and
    level, to the right-hand side. The plane is moved, at most by the angle `turn` (rad), so that
    reflected points come to lie on the points (point to plane, robust).
    """
    low, high = points.min(axis=0), points.max(axis=0)
    middle = (low + high) / 2
    points = points - middle
    tree = cKDTree(np.concatenate([points, _NORMAL_WEIGHT * normals], axis=1))
    chosen = downsample(points, _POINTS, np.random.default_rng(0))
    own, lines = points[chosen], normals[chosen]
    first = float(np.arctan2(start[0], start[2]))
    angle, offset = first, 0.0
    across = start
    residual = np.zeros(len(own))
    for scale in np.geomspace(0.1, 0.015, _ITERATIONS):
        across = np.array([np.sin(angle), 0.0, np.cos(angle)])
        along = np.array([np.cos(angle), 0.0, -np.sin(angle)])
        side = own @ across - offset
        reflected = own - 2 * side[:, None] * across
        turned = lines - 2 * (lines @ across)[:, None] * across
        features = np.concatenate([reflected, _NORMAL_WEIGHT * turned], axis=1)
        residual, index = tree.query(features)
        weight = 1.0 / (1.0 + (residual / scale) ** 2) ** 2
        # A counterpart is looked for on the surface that the nearest point lies on.
        gap = ((points[index] - reflected) * normals[index]).sum(axis=1)
        by_angle = -2 * ((own @ along)[:, None] * across + side[:, None] * along)
        slope = np.stack(
            [(by_angle * normals[index]).sum(axis=1), 2 * normals[index] @ across], axis=1
        )
        system = (slope * weight[:, None]).T @ slope + 1e-4 * len(own) * np.diag([0.25, 1e-2])
        change = np.linalg.solve(system, (slope * weight[:, None]).T @ gap)
        angle = float(np.clip(angle + change[0], first - turn, first + turn))
        offset = float(offset + np.clip(change[1], -0.1, 0.1))
    across = np.array([np.sin(angle), 0.0, np.cos(angle)])
    agreement = float((residual < _NEAR + 0.5 * _NORMAL_WEIGHT * 0.5).mean())
    return MirrorPlane(across, offset + float(across @ middle), agreement)
