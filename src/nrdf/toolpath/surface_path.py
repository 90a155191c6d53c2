"""A path before it is segments: a tool's contacts with the surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nrdf.geometry.polylines import total_length


@dataclass(frozen=True)
class SurfacePath:
    """A path on the surface: contacts (n, 3), m, and smooth outward normals (n, 3), in driving
    order; closed: a loop, whose last contact is its first."""

    contacts: np.ndarray
    normals: np.ndarray
    closed: bool = False

    @property
    def length_m(self) -> float:
        """The way along the contacts, m."""
        return total_length(self.contacts)

    def reversed(self) -> SurfacePath:
        """The same path from its end to its start."""
        return SurfacePath(self.contacts[::-1], self.normals[::-1], self.closed)

    def part(self, chosen: np.ndarray) -> SurfacePath:
        """Some of its contacts, by indices (k,) in driving order, as an open path."""
        return SurfacePath(self.contacts[chosen], self.normals[chosen])

    def from_contact(self, number: int) -> SurfacePath:
        """A loop that begins and ends at one of its contacts. An open path stays as it is."""
        if not self.closed:
            return self
        turn = np.roll(np.arange(len(self.contacts) - 1), -number)
        turn = np.append(turn, turn[0])
        return SurfacePath(self.contacts[turn], self.normals[turn], True)
