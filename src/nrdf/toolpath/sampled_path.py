"""A tool path sampled densely, and what its footprint covers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from nrdf.geometry.frames import unit_vectors
from nrdf.geometry.polylines import arc_length, even_arc_lengths, interpolate
from nrdf.toolpath.frames import travel_directions

_FACING = 0.2
"""Least cosine between the tool's axis and the normal of a place that its footprint reaches."""


@dataclass(frozen=True)
class SampledPath:
    """A tool path sampled densely.

    places: (n, 3) contacts; axes: (n, 3) tool z; travel: (n, 3), averaged over a distance to either
    side; arc_length: (n,), m, from the start, with a long step from line to line; step: m, between
    samples.
    """

    places: np.ndarray
    axes: np.ndarray
    travel: np.ndarray
    arc_length: np.ndarray
    step: float

    @staticmethod
    def along(
        contacts: list[np.ndarray], axes: list[np.ndarray], step: float, smooth: float
    ) -> SampledPath:
        """Samples of lines, `step` apart: contacts and axes (n, 3) of each line."""
        places, turned, travel, walked = [], [], [], []
        far = 0.0
        for line, axis in zip(contacts, axes, strict=True):
            way = arc_length(line)
            at = even_arc_lengths(float(way[-1]), step)
            fine = interpolate(at, way, line)
            places.append(fine)
            turned.append(interpolate(at, way, axis))
            travel.append(travel_directions(fine, smooth) if len(line) > 1 else np.zeros_like(fine))
            walked.append(far + at)
            far += way[-1] + 1e3
        place, axis, ahead, way = map(np.concatenate, (places, turned, travel, walked))
        return SampledPath(place, unit_vectors(axis), ahead, way, step)

    def coverage_count(self, points: np.ndarray, normals: np.ndarray, radius: float) -> np.ndarray:
        """How often (m,) the footprint passes over points (m, 3) with normals (m, 3)."""
        if not len(points):
            return np.zeros(0, int)
        point, place = _reached(points, normals, self.places, self.axes, radius)
        order = np.lexsort((place, point))
        point, way = point[order], self.arc_length[place[order]]
        new = np.ones(len(point), bool)
        new[1:] = (point[1:] != point[:-1]) | (np.diff(way) > 2.5 * self.step)
        return np.bincount(point[new], minlength=len(points))


def reached_points(
    points: np.ndarray,
    normals: np.ndarray,
    places: np.ndarray,
    axes: np.ndarray,
    radius: float,
) -> np.ndarray:
    """Whether (m,) a footprint at places (n, 3), tool z at axes (n, 3), reaches points (m, 3)."""
    reached = np.zeros(len(points), bool)
    if len(places) and len(points):
        reached[_reached(points, normals, places, axes, radius)[0]] = True
    return reached


def _reached(
    points: np.ndarray,
    normals: np.ndarray,
    places: np.ndarray,
    axes: np.ndarray,
    radius: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (k,), (k,) of a point and a place from which the footprint reaches it."""
    pairs = cKDTree(points).sparse_distance_matrix(cKDTree(places), radius, output_type="ndarray")
    point, place = pairs["i"], pairs["j"]
    facing = -np.einsum("pa,pa->p", normals[point], axes[place]) > _FACING
    return point[facing], place[facing]
