"""Flat sheets: their own main direction, and those of one plane that are worked as one.

The slats of a table top, with slits narrower than the tool between them, are one surface to it; so
is a plate whose mesh is cut by a seam.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from nrdf.surface.fine_mesh import FineMesh
from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.tool_clearance import has_clearance, needed_clearance
from nrdf.toolpath.planners.field_lines import Part

_FLAT = 0.995  # length of a sheet's mean normal
_ALIKE = float(np.cos(np.radians(2.5)))  # of the normals of two sheets of one plane
_SLIT, _STEP = 0.25, 0.1
"""Tool radii: how wide a slit is that lines run over, and how high a step in it."""
_PROBES, _ROOM = (
    100,
    0.1,
)  # places at which a sheet is looked at, and of its area, what must be free
_BORE, _ACROSS = 4.0, 0.3  # footprints, and the share of the area before which there is room
_HOLLOW = 0.02  # tool radii: the mean way to its middle, about, of what faces that
_SAMPLES = 0.2  # tool radii, between places on a border
_DIRECTIONS, _SPREAD = 90, 2  # directions that are told apart; how many either way are alike
_STRAIGHT = 0.3  # of a sheet's border: what runs one way gives its direction


def with_room(region: RegionMesh, sheets: Sequence[Part], radius_m: float) -> list[Part]:
    """Sheets without those in slits, whose walls no tool of that radius comes to; all of them where
    none would be left."""
    needed, kept = needed_clearance(0.0, radius_m), []
    for sheet in sheets:
        mesh = sheet.mesh
        chosen = np.linspace(0, len(mesh.faces) - 1, min(_PROBES, len(mesh.faces))).astype(int)
        free = has_clearance(region.parent, mesh.centres[chosen], mesh.normals[chosen], needed)
        area = mesh.areas[chosen]
        if float(area[free].sum()) > _ROOM * float(area.sum()):
            kept.append(sheet)
    return kept or list(sheets)


def is_bore(region: RegionMesh, part: Part, radius_m: float) -> bool:
    """Whether a small part is the wall of a hole for a screw: it faces its own middle, and the
    other wall is nearer than the tool's radius."""
    mesh = part.mesh
    area = float(mesh.areas.sum())
    if area > _BORE * np.pi * radius_m**2:
        return False
    outward = np.einsum("fa,fa->f", mesh.normals, mesh.centres - part.centre)
    if float(mesh.areas @ outward) > -_HOLLOW * radius_m * area:
        return False
    free = has_clearance(region.parent, mesh.centres, mesh.normals, radius_m)
    return float(mesh.areas[free].sum()) < _ACROSS * area


def is_flat(part: Part) -> bool:
    """Whether a sheet lies in a plane, nearly."""
    mean = np.average(part.mesh.normals, axis=0, weights=part.mesh.areas)
    return float(np.linalg.norm(mean)) > _FLAT


def main_direction(part: Part) -> np.ndarray | None:
    """The unit direction (3,) of the longest straight sides of an open sheet; None without any."""
    mesh = part.mesh
    if part.outward is None:
        return None
    pairs, of_face = mesh.edges
    border = pairs[np.bincount(of_face.ravel(), minlength=len(pairs)) == 1]
    side = mesh.vertices[border[:, 1]] - mesh.vertices[border[:, 0]]
    first = part.axes[0] - (part.axes[0] @ part.outward) * part.outward
    first /= max(float(np.linalg.norm(first)), 1e-300)
    second = np.cross(part.outward, first)
    x, y = side @ first, side @ second
    length = np.hypot(x, y)
    if not length.any():
        return None
    at = np.rint((np.arctan2(y, x) % np.pi) / np.pi * _DIRECTIONS).astype(int) % _DIRECTIONS
    found = np.bincount(at, length, minlength=_DIRECTIONS)
    shifts = range(-_SPREAD, _SPREAD + 1)
    near = np.sum([np.roll(found, k) * (_SPREAD + 1 - abs(k)) for k in shifts], axis=0)
    half = _DIRECTIONS // 2
    alike = np.abs((at - int(np.argmax(near)) + half) % _DIRECTIONS - half) <= _SPREAD
    if float(length[alike].sum()) < _STRAIGHT * float(length.sum()):
        return None
    # The mean of what runs that way, a direction and its opposite being the same.
    turn = 2.0 * np.arctan2(y[alike], x[alike])
    angle = 0.5 * np.arctan2(
        (length[alike] * np.sin(turn)).sum(), (length[alike] * np.cos(turn)).sum()
    )
    if part.slits and abs(np.cos(angle)) < abs(np.sin(angle)):
        angle += 0.5 * np.pi  # along all of it, over the slits, and not along its slats
    return np.asarray(np.cos(angle) * first + np.sin(angle) * second)


def joined_in_planes(sheets: Sequence[Part], radius_m: float) -> list[Part]:
    """Sheets in their order, flat ones of one plane with slits of less than a share of the tool's
    radius between them as one."""
    flat = [k for k, sheet in enumerate(sheets) if is_flat(sheet)]
    if len(flat) < 2:
        return list(sheets)
    outward = np.stack([np.asarray(sheets[k].outward) for k in flat])
    places = [_on_border(sheets[k].mesh, _SAMPLES * radius_m) for k in flat]
    owner = np.repeat(np.arange(len(flat)), [len(place) for place in places])
    every = np.concatenate(places)
    # Slits are narrow, but places on their two sides need not lie opposite.
    reach = np.hypot(_SLIT, 0.5 * _SAMPLES) * radius_m
    one, other = cKDTree(every).query_pairs(reach, output_type="ndarray").T
    apart = owner[one] != owner[other]
    one, other = one[apart], other[apart]
    normal = outward[owner[one]]
    good = np.einsum("pa,pa->p", normal, outward[owner[other]]) > _ALIKE
    height = np.abs(np.einsum("pa,pa->p", every[other] - every[one], normal))
    good &= height < _STEP * radius_m
    linked = coo_matrix(
        (np.ones(int(good.sum())), (owner[one[good]], owner[other[good]])), (len(flat),) * 2
    )
    group = connected_components(linked, directed=False)[1]
    made: list[Part] = []
    for k, sheet in enumerate(sheets):
        if k not in flat:
            made.append(sheet)
            continue
        mates = [flat[j] for j in np.flatnonzero(group == group[flat.index(k)])]
        if len(mates) == 1:
            made.append(sheet)
        elif k == mates[0]:
            made.append(Part(_together([sheets[j].mesh for j in mates]), slits=True))
    return sorted(made, key=lambda part: not part.slits)


def _on_border(mesh: FineMesh, step_m: float) -> np.ndarray:
    """Places (n, 3) along the border of a mesh, about `step_m` apart."""
    pairs, of_face = mesh.edges
    border = pairs[np.bincount(of_face.ravel(), minlength=len(pairs)) == 1]
    start, stop = mesh.vertices[border[:, 0]], mesh.vertices[border[:, 1]]
    count = np.ceil(np.linalg.norm(stop - start, axis=1) / step_m).astype(int)
    of = np.repeat(np.arange(len(border)), count)
    share = (np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count) + 0.5) / count[of]
    return np.asarray(start[of] + share[:, None] * (stop - start)[of])


def _together(meshes: Sequence[FineMesh]) -> FineMesh:
    first = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
    return FineMesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.faces + shift for mesh, shift in zip(meshes, first, strict=True)]),
        np.concatenate([mesh.origin for mesh in meshes]),
        max(mesh.edge_m for mesh in meshes),
    )
