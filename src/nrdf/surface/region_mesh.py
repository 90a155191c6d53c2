"""A region of a target mesh: its own faces, borders and parts, and how it follows from votes."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from nrdf.errors import ProcessError
from nrdf.geometry.frames import unit_vectors
from nrdf.surface.mesh_cut import FineMesh
from nrdf.surface.mesh_edges import boundary_loops, edge_components, opposite_half_edges
from nrdf.surface.region_border import LEVEL, Votes, cut_at_border
from nrdf.surface.target_mesh import TargetMesh

_ALIKE = 0.5  # least cosine between a hole and the region around it
_TOUCH, _APART = 1e-5, 1e-5  # longest sides within which parts touch, if they look the same way


@dataclass(frozen=True, eq=False)
class RegionMesh:
    """mesh: the region's own faces, cut within triangles at its border. parent: the whole object.
    changes: what was done to the region that was found, in words."""

    mesh: TargetMesh
    parent: TargetMesh
    changes: tuple[str, ...] = ()

    @staticmethod
    def from_faces(target: TargetMesh, face_mask: np.ndarray) -> RegionMesh:
        """Whole faces of a target, chosen by a mask (f,). Raises ProcessError if there are none."""
        face_mask = np.asarray(face_mask)
        if face_mask.dtype != bool or face_mask.shape != (len(target.faces),):
            raise ProcessError(
                f"a region of faces is a mask of {len(target.faces)}, not {face_mask.dtype} of "
                f"{face_mask.shape}"
            )
        if not face_mask.any():
            raise ProcessError("a region must have at least one face of the target's mesh")
        return RegionMesh(target.submesh(face_mask), target)

    @property
    def area_m2(self) -> float:
        """The region's area, m²."""
        return float(self.mesh.face_areas.sum())

    @cached_property
    def boundary_loops(self) -> list[np.ndarray]:
        """Closed loops of vertex indices, the longest first: the outer border and holes.

        Each runs with the region on its left, seen from outside; the first vertex is not repeated.
        """
        loops = boundary_loops(self.mesh.faces)
        return sorted(loops, key=lambda loop: -self.loop_length(loop))

    def loop_length(self, loop: np.ndarray) -> float:
        """Length, m, of a closed loop of vertex indices (n,)."""
        places = self.mesh.vertices[loop]
        return float(np.linalg.norm(places - np.roll(places, 1, axis=0), axis=1).sum())

    def components(self) -> list[RegionMesh]:
        """The parts that no edge connects, the largest first."""
        number = edge_components(self.mesh.faces)
        area = np.bincount(number, self.mesh.face_areas)
        order = np.argsort(-area, kind="stable")
        if len(order) == 1:
            return [self]
        parts = (self.mesh.submesh(number == part) for part in order)
        return [RegionMesh(part, self.parent, self.changes) for part in parts]


@dataclass(frozen=True)
class RegionMeshes:
    """found: name to region. left_out: name of a region to the reason why there is none of it, a
    sentence."""

    found: dict[str, RegionMesh]
    left_out: dict[str, str]


def region_meshes(
    target: TargetMesh,
    points: np.ndarray,
    normals: np.ndarray,
    memberships: Mapping[str, np.ndarray],
    tool_radius_m: Mapping[str, float],
    fill_holes: Collection[str] = (),
    allow_overlap: bool = False,
) -> RegionMeshes:
    """All regions of one object that votes stand for, with smooth borders, as tools can work them.

    points: (n, 3), m, of the whole target, with outward normals (n, 3). memberships: name to (n,),
    0 to 1. tool_radius_m: name to the radius of the tool that works the region. Specks smaller
    than the tool's footprint are removed and holes smaller than it filled; of the regions in
    `fill_holes` all holes are. Raises ProcessError for arrays that do not fit each other.
    """
    found: dict[str, RegionMesh] = {}
    left_out: dict[str, str] = {}
    for name, membership in memberships.items():
        if not (np.asarray(membership) > LEVEL).any():
            left_out[name] = "No point belongs to the region by more than a half."
            continue
        try:
            found[name] = region_mesh(
                target, points, normals, membership, tool_radius_m[name], name in fill_holes
            )
        except NothingLeft as error:
            left_out[name] = f"{str(error)[0].upper()}{str(error)[1:]}."
    return RegionMeshes(found, left_out)


class NothingLeft(ProcessError):
    """All parts of a region are smaller than its tool."""


def region_mesh(
    target: TargetMesh,
    points: np.ndarray,
    normals: np.ndarray,
    membership: np.ndarray,
    tool_radius_m: float,
    fill_holes: bool = False,
) -> RegionMesh:
    """The region that votes stand for, with a smooth border, as a tool can work it.

    points: (n, 3), m, of the whole target, with outward normals (n, 3) and membership (n,), 0 to 1.
    Specks smaller than the tool's footprint are removed and holes smaller than it filled; with
    fill_holes all holes are. Faces that other parts of the object cover are left out. Raises
    ProcessError where nothing is left, or for arrays that do not fit each other.
    """
    if not (np.isfinite(tool_radius_m) and tool_radius_m > 0.0):
        raise ProcessError(f"the tool's radius must be above 0 m, not {tool_radius_m:g}")
    votes = Votes.checked(points, normals, membership)
    fine, inside = cut_at_border(target, votes, tool_radius_m, fill_holes)
    footprint = np.pi * tool_radius_m**2
    changes: list[str] = []
    inside, filled = _without_holes(target, fine, inside, np.inf if fill_holes else footprint)
    changes += _said(filled, "hole", "filled")
    inside, removed = _without_specks(target, fine, inside, footprint)
    changes += _said(removed, "speck", "smaller than the tool removed")
    if not inside.any():
        raise NothingLeft(
            "nothing is left of the region: all its parts are smaller than the tool's footprint of "
            f"{1e4 * footprint:.3g} cm²; take a smaller tool"
        )
    piece = fine.of_faces(inside)
    return RegionMesh(TargetMesh(piece.vertices, piece.faces), target, tuple(changes))


def _without_holes(
    target: TargetMesh, fine: FineMesh, inside: np.ndarray, largest: float
) -> tuple[np.ndarray, list[float]]:
    """The region's faces (f,) with holes up to an area (m²) filled, and the areas of those.

    A hole is a part of the rest that only one part of the region surrounds, is smaller than that,
    and looks the same way.
    """
    number = edge_components(fine.faces, inside)
    areas = fine.areas
    area = np.bincount(number, areas)
    weighted = areas[:, None] * target.face_normals[fine.origin]
    facing = np.stack([np.bincount(number, weighted[:, a]) for a in range(3)], axis=1)
    of_region = np.zeros(len(area), bool)
    of_region[number[inside]] = True
    opposite = opposite_half_edges(fine.faces)
    half = np.flatnonzero(opposite >= 0)
    here, there = number[half // 3], number[opposite[half] // 3]
    meet = ~of_region[here] & of_region[there]
    pairs = np.unique(np.stack([here[meet], there[meet]], axis=1), axis=0)
    # Which way the region looks along the border with each part of the rest.
    along = np.zeros((len(area), 3))
    np.add.at(along, here[meet], target.face_normals[fine.origin[opposite[half[meet]] // 3]])
    open_sided = np.zeros(len(area), bool)
    open_sided[number[np.flatnonzero(opposite < 0) // 3]] = True
    around = np.bincount(pairs[:, 0], minlength=len(area))
    alike = np.einsum(
        "pa,pa->p",
        unit_vectors(facing),
        along / np.maximum(np.bincount(here[meet], minlength=len(area)), 1)[:, None],
    )
    filled = []
    for hole, region in pairs:
        closed = around[hole] == 1 and not open_sided[hole] and alike[hole] > _ALIKE
        if closed and area[hole] <= min(largest, area[region]):
            filled.append(int(hole))
    return inside | np.isin(number, filled), [float(area[hole]) for hole in filled]


def _without_specks(
    target: TargetMesh, fine: FineMesh, inside: np.ndarray, footprint: float
) -> tuple[np.ndarray, list[float]]:
    """The region's faces (f,) without parts smaller than a footprint (m²), and their areas.

    Parts that touch, facing the same way, count as one: not all meshes are sewn together.
    """
    chosen = np.flatnonzero(inside)
    number = edge_components(fine.faces[chosen])
    areas = fine.areas[chosen]
    group = _touching(target, fine, chosen, number)
    area = np.bincount(group, areas)
    small = area < footprint
    kept = inside.copy()
    kept[chosen[small[group]]] = False
    return kept, [float(a) for a in area[small]]


def _touching(
    target: TargetMesh, fine: FineMesh, chosen: np.ndarray, number: np.ndarray
) -> np.ndarray:
    """Group (f,) of each chosen face: its part, with the parts of its side that it touches."""
    count = int(number.max(initial=-1)) + 1
    corner = fine.faces[chosen].reshape(-1)
    place = np.hstack(
        [
            fine.vertices[corner],
            _APART * target.size * np.repeat(target.face_normals[fine.origin[chosen]], 3, axis=0),
        ]
    )
    tree = cKDTree(place)
    pairs = tree.query_pairs(_TOUCH * target.size, output_type="ndarray")
    one, two = (np.repeat(number, 3)[pairs[:, k]] for k in (0, 1))
    links = coo_matrix((np.ones(len(one), bool), (one, two)), (count, count))
    return np.asarray(connected_components(links, directed=False)[1])[number]


def _said(areas: list[float], noun: str, done: str) -> list[str]:
    if not areas:
        return []
    nouns = noun if len(areas) == 1 else noun + "s"
    return [f"{len(areas)} {nouns} {done} ({1e4 * sum(areas):.3g} cm²)"]
