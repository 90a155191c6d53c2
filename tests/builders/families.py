"""Places on members of parametric families."""

from __future__ import annotations

import numpy as np

from nrdf.shapes.families import Family, Member, SurfaceCoordinates
from nrdf.shapes.families.base import SIDE

EPS = 3e-5  # canonical; small, because trailing edges are thin


def flips(member: Member, points: np.ndarray, normals: np.ndarray) -> float:
    """Share of points with material just behind and none just in front."""
    inside = member.occupancy(points - EPS * normals)
    outside = ~member.occupancy(points + EPS * normals)
    return float((inside & outside).mean())


def on_slot(family: Family, slot: str, u: object, v: object) -> SurfaceCoordinates:
    """Coordinates on the SIDE face of a slot."""
    u, v = np.broadcast_arrays(np.atleast_1d(np.asarray(u, float)), np.asarray(v, float))
    number = np.full(u.shape, family.slot(slot), np.int32)
    return SurfaceCoordinates(number, np.full(u.shape, SIDE, np.int32), u.copy(), v.copy())


class Placed:
    """One list of coordinates, found on every member."""

    def __init__(self, family: Family, members: list[Member]) -> None:
        self.family = family
        self.coordinates = family.canonical_coordinates(3000, np.random.default_rng(0), members=30)
        self.found = [member.locate(self.coordinates) for member in members]

    def __call__(self, name: str) -> list[tuple[np.ndarray, np.ndarray]]:
        """Points and normals of one region, a pair for each member."""
        mask = self.family.region(name, self.coordinates)
        return [(f.points[f.exists & mask], f.normals[f.exists & mask]) for f in self.found]
