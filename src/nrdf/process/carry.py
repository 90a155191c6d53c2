"""Taught waypoints carried through the correspondence, and directions.

Each waypoint's foot on the reference's surface is mapped by C, brought onto the target's smooth
surface, and the tool keeps its place and angles relative to the local frame of travel and normal.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from nrdf.geometry import thin
from nrdf.process.frames import surface_frames, travel_of
from nrdf.process.surface import SAME_SIDE, Surface, unit
from nrdf.process.taught import TaughtLine, feet_under
from nrdf.regions.association import NORMAL_WEIGHT, oriented_features
from nrdf.regions.model import Embedded, Taught
from nrdf.shapes.registration import RegistrationSettings, RegistrationTemplate

FARTHEST, BEYOND, LEAST_TRUST = 0.06, 0.025, 0.3
"""A waypoint has a counterpart where C's place is at most so far off the target's points, in all,
and beyond an edge or in a hole, as shares of the longest side, not counting the distance between
points; and where C trusts it."""
_AROUND = 12  # points that tell whether a place is on the surface between them
_TORN, _GAP = 1.5, 1.2  # times its length on the reference, and spacings, that a step may have
_ANCHORS = 1200  # points of the reference whose places are settled
_BLENDED, _BLEND = 8, 0.005  # anchors that a place follows, and the distance that softens it
_SETTLING = RegistrationSettings(
    iterations=8,
    radius_start=0.3,
    radius_end=0.15,
    normal_weight_start=0.15,
    normal_weight_end=0.1,
    match_scale=0.06,
)
"""Chosen on unseen family pairs (`nrdf eval carry`)."""
_SMOOTH = 2.0  # spacings of points over which the direction of travel is averaged


@dataclass(frozen=True)
class CarriedLine(TaughtLine):
    """A line on the target. normals: (n, 3) of the surface under it; taught: number of the taught
    line; waypoints: (n,) which of its waypoints these are."""

    normals: np.ndarray
    taught: int
    waypoints: np.ndarray


class TaughtSurface:
    """A reference as waypoints are carried from it: as the field sees it, and as a surface."""

    def __init__(self, taught: Taught) -> None:
        self.taught = taught
        self.surface = surface_of(taught.reference)

    @cached_property
    def anchors(self) -> np.ndarray:
        """Even points (a,) of the working cloud whose places on a target are settled."""
        return thin(self.taught.reference.points, _ANCHORS, np.random.default_rng(0))

    @cached_property
    def template(self) -> RegistrationTemplate:
        """The anchors, ready to be moved."""
        reference, at = self.taught.reference, self.anchors
        return RegistrationTemplate(reference.points[at], reference.normals[at], _SETTLING)

    @cached_property
    def tree(self) -> cKDTree:
        """The anchors in position and normal."""
        reference, at = self.taught.reference, self.anchors
        return cKDTree(
            oriented_features(reference.points[at], reference.normals[at], NORMAL_WEIGHT)
        )


class Correspondence:
    """The way from a reference's surface to a target's, both in metres.

    C's places are settled: a smooth, small displacement, the same as in registration, brings the
    whole mapped reference and the target closer, both ways, so that edges come to lie on edges.
    """

    def __init__(self, reference: TaughtSurface, embedded: Embedded) -> None:
        self.reference, self.embedded = reference, embedded
        self.target = surface_of(embedded)
        features = oriented_features(embedded.points, embedded.normals, NORMAL_WEIGHT)
        self._tree = cKDTree(features)

    @cached_property
    def _settled(self) -> np.ndarray:
        """Displacement (a, 3) of each anchor's place, canonical."""
        reference, embedded = self.reference, self.embedded
        mapped = reference.taught.map_surface(embedded)
        start = mapped.points[reference.anchors]
        facing = unit(mapped.normals[reference.anchors])
        at = thin(embedded.points, 2 * _ANCHORS, np.random.default_rng(1))
        moved = reference.template.register(
            embedded.points[at], embedded.normals[at], (start, facing)
        )
        return np.asarray(moved.points - start)

    def places(
        self, points: np.ndarray, normals: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Where places (m, 3) of the reference's surface, with normals (m, 3), are on the target.

        Returns places on its smooth surface (m, 3), normals there (m, 3), and whether the place
        exists (m,): the field trusts it, and it lies near the surface.
        """
        embedded, whole = self.embedded, self.reference.taught.reference
        mapped = self.reference.taught.map_places(points, normals, embedded)
        asked = oriented_features((points - whole.centre) / whole.scale, normals, NORMAL_WEIGHT)
        distance, near = self.reference.tree.query(asked, _BLENDED)
        weight = 1.0 / (distance + _BLEND) ** 2
        weight /= weight.sum(axis=1, keepdims=True)
        arrived = mapped.points + np.einsum("mk,mka->ma", weight, self._settled[near])
        facing = unit(mapped.normals)
        nearest = self._tree.query(oriented_features(arrived, facing, NORMAL_WEIGHT))[1]
        start, outward = embedded.original(embedded.points[nearest]), embedded.normals[nearest]
        offset = embedded.original(arrived) - start
        sideways = offset - np.einsum("ma,ma->m", offset, outward)[:, None] * outward
        beyond = self._beyond(start, sideways, outward)
        kept = start + sideways * (1.0 - beyond / np.maximum(_lengths(sideways), 1e-12))[:, None]
        found, found_normals = self.target.project(kept, outward)
        size, spacing = embedded.scale, self.target.spacing
        exists = _lengths(offset) <= FARTHEST * size + spacing
        exists &= beyond <= BEYOND * size + spacing
        return found, found_normals, exists & (mapped.trust >= LEAST_TRUST)

    def _beyond(self, start: np.ndarray, sideways: np.ndarray, outward: np.ndarray) -> np.ndarray:
        """How far (m,) places `start + sideways` (m, 3) lie off the edge of the target's points.

        A place with points of its side around and ahead of it is on the surface between them.
        """
        target, length = self.target, _lengths(sideways)
        near = np.arange(1, min(_AROUND, len(target.points)) + 1)
        distance, near = target.tree.query(start + sideways, near)
        alike = np.einsum("mka,ma->mk", target.normals[near], outward) > SAME_SIDE
        alike &= distance < 2.0 * target.spacing
        ahead = np.einsum("mka,ma->mk", target.points[near] - start[:, None], unit(sideways))
        reach = np.where(alike, ahead, 0.0).max(axis=1)
        return np.maximum(length - np.maximum(reach, 0.0), 0.0)

    def direction(self, region: np.ndarray, direction: np.ndarray) -> np.ndarray:
        """A direction (3,) at a region of the reference, unit length, as it is on the target.

        region: (k,) indices into the reference's cloud. The smooth map between the two regions is
        taken as affine; across the surface, where points do not tell, as a turn and a scale.
        """
        taught = self.reference.taught
        here = taught.reference.cloud.points[region]
        there = self.embedded.original(taught.map_points(region, self.embedded).points)
        here, there = here - np.median(here, axis=0), there - np.median(there, axis=0)
        spread = here.T @ here
        size = float(np.trace(spread))
        if len(here) < 3 or size == 0.0:  # a spot does not tell how it is turned
            return unit(np.asarray(direction, float))
        turn, _ = Rotation.align_vectors(there, here)
        similar = np.sqrt((there**2).sum() / size) * turn.as_matrix()
        ridge = 0.05 * size / 3.0 * np.eye(3)
        affine = np.linalg.solve(spread + ridge, here.T @ there + ridge @ similar.T).T
        return unit(affine @ unit(np.asarray(direction, float)))

    def carry(
        self, lines: Sequence[TaughtLine], tool_radius_m: float
    ) -> tuple[tuple[CarriedLine, ...], int]:
        """Lines on the reference as lines on the target, and how many waypoints have no place.

        A line is cut where waypoints have no counterpart, and where the surface is torn between
        two of them, so that no tool is driven across a gap. The tool's height over the surface, and
        its angles to travel and normal, stay; a flat tool of `tool_radius_m` feels the normals.
        """
        if not lines:
            return (), 0
        source = self.reference.surface
        positions = np.concatenate([line.positions for line in lines])
        quaternions = np.concatenate([line.quaternions_xyzw for line in lines])
        owner = np.repeat(np.arange(len(lines)), [len(line.positions) for line in lines])
        turns = Rotation.from_quat(quaternions).as_matrix()
        feet, normals = feet_under(source, positions, -turns[:, :, 2])
        felt = source.smooth_normals(feet, normals, tool_radius_m)
        found, found_normals, exists = self.places(feet, normals)
        found_felt = self.target.smooth_normals(found, found_normals, tool_radius_m)
        # Where there is no line to tell the travel, a short way along tool x is mapped.
        ahead, ahead_normals = source.project(feet + 2 * source.spacing * turns[:, :, 0], normals)
        step = self.places(ahead, ahead_normals)[0] - found
        grown = self.embedded.scale / self.reference.taught.reference.scale
        carried, lost = [], int((~exists).sum())
        for number in range(len(lines)):
            mine = np.flatnonzero(owner == number)
            step_there = _lengths(np.diff(found[mine], axis=0))
            step_here = _lengths(np.diff(feet[mine], axis=0))
            torn = step_there > _TORN * grown * step_here + _GAP * self.target.spacing
            for run in _runs(exists[mine], torn):
                at = mine[run]
                frames = _frames(feet[at], felt[at], turns[at, :, 0], source.spacing)
                there = _frames(found[at], found_felt[at], step[at], self.target.spacing)
                change = there @ frames.transpose(0, 2, 1)
                offset = np.einsum("mab,mb->ma", change, positions[at] - feet[at])
                turned = Rotation.from_matrix(change @ turns[at]).as_quat()
                line = CarriedLine(found[at] + offset, turned, found_felt[at], number, run)
                carried.append(line)
        return tuple(carried), lost


def surface_of(embedded: Embedded) -> Surface:
    """The surface of a cloud in metres, of the points that the field works on."""
    return Surface(embedded.original(embedded.points), embedded.normals)


def _lengths(vectors: np.ndarray) -> np.ndarray:
    return np.linalg.norm(vectors, axis=1)


def _frames(
    points: np.ndarray, normals: np.ndarray, alone: np.ndarray, spacing: float
) -> np.ndarray:
    """Frames (n, 3, 3) of travel and normal along a line; `alone` (n, 3) is the travel of one
    that stands still."""
    moves = len(points) > 1 and float(np.ptp(points, axis=0).max()) > 0.5 * spacing
    travel = travel_of(points, _SMOOTH * spacing) if moves else alone
    return surface_frames(travel, normals)


def _runs(good: np.ndarray, torn: np.ndarray) -> list[np.ndarray]:
    """Indices of each stretch of True in `good` (n,) that `torn` (n - 1,) between two does not
    break."""
    places = np.flatnonzero(good)
    if not len(places):
        return []
    broken = (np.diff(places) > 1) | torn[places[:-1]]
    return np.split(places, np.flatnonzero(broken) + 1)
