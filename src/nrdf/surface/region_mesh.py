"""A region of a target mesh: its own faces, borders and parts, and how it follows from votes."""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from threading import RLock
from typing import Any, TypeVar

import numpy as np

from nrdf.errors import ProcessError
from nrdf.surface.mesh_edges import boundary_loops, edge_components
from nrdf.surface.region_border import LEVEL, Votes, cut_at_borders
from nrdf.surface.region_pieces import Pieces
from nrdf.surface.smooth_normals import SmoothNormals
from nrdf.surface.target_mesh import TargetMesh

Made = TypeVar("Made")
_WORTH = 0.1  # footprints, an area that is worth a word
_SAME = 1e-6  # of the object's size: how near to the object's mesh a region's places are on it
_OFF, _TIMES = 0.99, 2.0
"""Share of a region's places, and times their largest distance from its object, within which they
are the object's own: where it was cut from another mesh of the object."""


@dataclass(frozen=True, eq=False)
class RegionMesh:
    """mesh: the region's own faces, cut within triangles at its border. parent: the whole object.
    changes: what was done to the region that was found, in words. rough: for a first look: it is
    planned on in triangles that stay the same while the stepover changes a little, so that what was
    worked out on them is used again, and not measured in all."""

    mesh: TargetMesh
    parent: TargetMesh
    changes: tuple[str, ...] = ()
    rough: bool = False
    _felt: dict[float, SmoothNormals] = field(default_factory=dict, repr=False)
    _lock: Any = field(default_factory=RLock, repr=False)

    def __reduce__(self) -> tuple[Any, ...]:
        """For other processes, as of `TargetMesh`."""
        return RegionMesh, (self.mesh, self.parent, self.changes, self.rough)

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

    @cached_property
    def memo(self) -> dict[Hashable, Any]:
        """What was worked out of the region before, by all that it depends on."""
        return {}

    def last(self, name: Hashable, key: Hashable, make: Callable[[], Made]) -> Made:
        """What was made last under a name, where that was for the same key; else made now."""
        kept = self.memo.get(name)
        if kept is None or kept[0] != key:
            kept = self.memo[name] = key, make()
        made: Made = kept[1]
        return made

    @cached_property
    def for_a_look(self) -> RegionMesh:
        """The same region, rough; what is worked out of the one serves the other."""
        rough = replace(self, rough=True)
        rough.__dict__["memo"] = self.memo
        return rough

    def on_parent(
        self, points: np.ndarray, normals: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, float]:
        """Places (m, 3), m, and normals (m, 3) on the parent, of points (m, 3) of the region and
        their normals, and within which distance, m, a place of the one is one of the other.

        A region that was found on a scan lies a little above or below the mesh that was given:
        below it everything would be in the way.
        """
        same = _SAME * self.parent.size
        there = self.parent.nearest(points, normals)
        off = float(np.quantile(there.distances, _OFF)) if len(points) else 0.0
        if off <= same:
            return points, normals, same
        same = _TIMES * off
        near = (there.distances < same)[:, None]
        places = np.where(near, there.points, points)
        return places, np.where(near, there.normals, normals), same

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

    def felt_normals(self, points: np.ndarray, faces: np.ndarray, radius_m: float) -> np.ndarray:
        """`TargetMesh.smooth_normals` of the whole object at points (m, 3), m, on its `faces` (m,);
        around the region without a look at the rest."""
        with self._lock:
            if radius_m not in self._felt:
                near = self.mesh.vertices, self.mesh.faces
                around = self.parent.vertices, self.parent.faces
                self._felt[radius_m] = SmoothNormals(*around, radius_m, near)
        felt, points = self._felt[radius_m], np.asarray(points)
        known = felt.known(points)
        if not known.all():
            return self.parent.smooth_normals(points, faces, radius_m)
        return felt(points, self.parent.face_normals[faces])

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
    `fill_holes` all holes are. Unless they may overlap, each place belongs to the region with the
    largest membership there. Raises ProcessError for arrays that do not fit each other.
    """
    for name in memberships:
        radius = tool_radius_m.get(name, np.nan)
        if not (np.isfinite(radius) and radius > 0.0):
            raise ProcessError(f"{name}: the tool's radius must be above 0 m, not {radius:g}")
    votes = Votes.checked(points, normals, memberships)
    left_out = {
        name: "No point belongs to the region by more than a half."
        for number, name in enumerate(memberships)
        if not (votes.membership[:, number] > LEVEL).any()
    }
    if len(left_out) == len(memberships):
        return RegionMeshes({}, left_out)
    there = [name for name in memberships if name not in left_out]
    cut = cut_at_borders(target, votes, min(tool_radius_m[name] for name in there), allow_overlap)
    pieces = Pieces(cut.mesh, cut.inside)
    footprint = {name: np.pi * tool_radius_m[name] ** 2 for name in there}
    changes: dict[str, list[str]] = {name: [] for name in there}
    inside: dict[str, np.ndarray] = {}
    for faces, given_away, name in zip(cut.inside, cut.given_away, memberships, strict=True):
        if name not in there:
            continue
        if given_away > _WORTH * footprint[name]:
            changes[name] += _said([given_away], "overlap", "given to another region")
        inside[name], removed = pieces.without_specks(faces, footprint[name])
        changes[name] += _said(removed, "speck", "smaller than the tool removed")
        if not inside[name].any():
            left_out[name] = (
                "Nothing is left of the region: all its parts are smaller than the tool's "
                f"footprint of {1e4 * footprint[name]:.3g} cm²; take a smaller tool."
            )
    taken = np.sum([*inside.values()], axis=0)
    found: dict[str, RegionMesh] = {}
    for name in (name for name in there if name not in left_out):
        others = (taken > inside[name]) & (not allow_overlap)
        largest = np.inf if name in fill_holes else footprint[name]
        whole, filled, kept = pieces.without_holes(inside[name], others, largest)
        changes[name] += _said(filled, "hole", "filled")
        changes[name] += _said(kept, "hole", "larger than the tool kept")
        piece = cut.mesh.part(whole)
        mesh = TargetMesh(piece.vertices, piece.faces)
        found[name] = RegionMesh(mesh, target, tuple(changes[name]))
    return RegionMeshes(found, left_out)


def region_mesh(
    target: TargetMesh,
    points: np.ndarray,
    normals: np.ndarray,
    membership: np.ndarray,
    tool_radius_m: float,
    fill_holes: bool = False,
) -> RegionMesh:
    """One region, as `region_meshes` finds it. Raises ProcessError where nothing is left of it."""
    name = "region"
    meshes = region_meshes(
        target,
        points,
        normals,
        {name: membership},
        {name: tool_radius_m},
        {name} if fill_holes else (),
    )
    if name in meshes.left_out:
        raise ProcessError(meshes.left_out[name])
    return meshes.found[name]


def _said(areas: list[float], noun: str, done: str) -> list[str]:
    if not areas:
        return []
    nouns = noun if len(areas) == 1 else noun + "s"
    return [f"{len(areas)} {nouns} {done} ({1e4 * sum(areas):.3g} cm²)"]
