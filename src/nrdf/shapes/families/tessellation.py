"""Members as triangles whose every point knows its surface coordinates: what rays can be cast on.

Parts are tessellated one by one and overlap as the parts do; what lies inside another part is
hidden from every ray that comes from outside.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nrdf.shapes.families.base import CAP_START, CAP_STOP, SIDE, WALL, Array, SurfaceCoordinates
from nrdf.shapes.families.member import Member

_PLAIN = (72, 48)  # cells around and along a face
_CUT = (160, 128)  # of parts with windows, whose edges are as coarse as the cells
_WALL = (48, 2)


@dataclass(frozen=True)
class Tessellation:
    """Triangles of a member, canonical.

    vertices: (v, 3); faces: (f, 3), of any winding; coordinates: (v,) of the vertices, of which all
    three of a triangle share slot and face.
    """

    vertices: Array
    faces: np.ndarray
    coordinates: SurfaceCoordinates

    def at(self, face: np.ndarray, second: Array, third: Array) -> SurfaceCoordinates:
        """Surface coordinates (n,) at barycentric weights `second`, `third` (n,) of the second and
        third corner of triangles `face` (n,)."""
        corners = self.faces[face]
        weights = np.stack([1 - second - third, second, third], axis=1)
        known = self.coordinates
        return SurfaceCoordinates(
            known.slot[corners[:, 0]],
            known.face[corners[:, 0]],
            (known.u[corners] * weights).sum(axis=1),
            (known.v[corners] * weights).sum(axis=1),
        )


def tessellate(member: Member) -> Tessellation:
    """Triangles of all parts of a member; about 20,000 a part, more where it has windows."""
    vertices, faces, rows, total = [], [], [], 0
    for part in member.parts:
        slot = member.slots.index(part.slot)
        sizes = dict.fromkeys((SIDE, CAP_START, CAP_STOP), _CUT if part.windows else _PLAIN)
        sizes |= {WALL + window.key: _WALL for window in part.windows}
        for which, (around, along) in sizes.items():
            u, v, cells = _grid(around, along)
            middle_u, middle_v = u[cells].mean(axis=1), v[cells].mean(axis=1)
            there = part.surface(np.full(len(cells), which), middle_u, middle_v)[2]
            vertices.append(part.points(np.full(len(u), which), u, v))
            faces.append(cells[there][:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3) + total)
            rows.append(
                SurfaceCoordinates(
                    np.full(len(u), slot, np.int32), np.full(len(u), which, np.int32), u, v
                )
            )
            total += len(u)
    return Tessellation(
        np.concatenate(vertices), np.concatenate(faces), SurfaceCoordinates.concatenate(rows)
    )


def _grid(around: int, along: int) -> tuple[Array, Array, np.ndarray]:
    """u, v (n,) of the nodes, and the nodes (m, 4) around each cell."""
    u, v = np.meshgrid(np.linspace(0, 1, around + 1), np.linspace(0, 1, along + 1))
    node = np.arange(u.size).reshape(u.shape)
    corners = (node[:-1, :-1], node[:-1, 1:], node[1:, 1:], node[1:, :-1])
    return u.ravel(), v.ravel(), np.stack([c.ravel() for c in corners], axis=1)
