"""Real meshes in metres, with regions to plan on: labelled parts, parts of cars, whole patches."""

from __future__ import annotations

import hashlib
import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path

import igl
import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from trimesh import remesh

from nrdf.errors import DataError
from nrdf.geometry.canonical import canonical_transform
from nrdf.geometry.frames import unit_vectors
from nrdf.geometry.mesh import (
    Skin,
    check_mesh,
    clean_faces,
    outer_skin,
    triangle_areas,
    triangle_crosses,
)
from nrdf.io.formats.meshes import load_mesh
from nrdf.surface.target_mesh import TargetMesh
from nrdf.toolpath.strategy import Strategy
from nrdf_benchmark.objects.dataset import LABELS, LabelledMesh, read_labels, read_objects

FURNITURE_M, CAR_M, PLANE_M, WHOLE_M = 0.9, 4.5, 4.5, 1.05
"""Longest sides. A mesh that is one region measures 1.05 m: ten and a half units of 0.1 m."""
FINE = Strategy(stepover_m=0.025, spacing_m=0.01, tool_radius_m=0.025)
COARSE = Strategy(stepover_m=0.05, spacing_m=0.01, tool_radius_m=0.05)
"""A pad of 50 mm for furniture and patches, one of 100 mm for cars and aircraft; lines half of it
apart."""
CARS, PLANES = "car", "plane"
"""Names of folders of cars and aircraft: +X forward, +Y up."""
SAMPLES = 60_000  # points of the outer skin that figures are measured at
LEAST_POINTS = 30  # of a region
_EDGE = 0.01  # of a car's or an aircraft's longest side
_SUFFIXES = (".ply", ".stl", ".obj", ".off", ".glb")


@dataclass(frozen=True)
class MeshTarget:
    """A mesh to plan on. vertices: (v, 3), m; faces: (f, 3), turned outwards; regions: name to a
    mask (f,); checksum: SHA-256 of its file; strategy: how its regions are worked."""

    name: str
    vertices: np.ndarray
    faces: np.ndarray
    regions: dict[str, np.ndarray]
    checksum: str
    strategy: Strategy

    @cached_property
    def skin(self) -> Skin:
        """`SAMPLES` points of the outer skin, less those that nothing outside sees."""
        rng = np.random.default_rng(zlib.crc32(self.name.encode()))
        return outer_skin(self.vertices, self.faces, SAMPLES, rng)[1]

    @cached_property
    def given_mesh(self) -> TargetMesh:
        """The mesh as it was given, nothing repaired: what stands before a place is asked of it."""
        return TargetMesh(self.vertices, self.faces)

    @cached_property
    def point_area_m2(self) -> float:
        """The area that a point of the skin stands for."""
        return float(triangle_areas(self.vertices, self.faces).sum() / SAMPLES)

    def indices(self, region: str) -> np.ndarray:
        """Which of the skin's points (k,) lie on a region."""
        return np.flatnonzero(self.regions[region][self.skin.face])

    def nearest_faces(self, points: np.ndarray) -> np.ndarray:
        """The face (m,) nearest to each of points (m, 3), m."""
        vertices, faces = np.ascontiguousarray(self.vertices), np.ascontiguousarray(self.faces)
        tree = igl.AABB()
        tree.init(vertices, faces)
        return np.asarray(tree.squared_distance(vertices, faces, np.ascontiguousarray(points))[1])

    @cached_property
    def visible_regions(self) -> tuple[str, ...]:
        """The regions of which at least `LEAST_POINTS` points can be seen."""
        return tuple(name for name in self.regions if len(self.indices(name)) >= LEAST_POINTS)


@dataclass(frozen=True)
class TargetSource:
    """A mesh that is read when its turn comes. checksum: SHA-256 of its file."""

    name: str
    checksum: str
    read: Callable[[], MeshTarget]


def target_sources(places: Sequence[Path], sample: int | None = None) -> list[TargetSource]:
    """All meshes of folders and files, in a fixed order; or `sample` of each place, evenly chosen.

    A folder with labels.json holds labelled objects (`nrdf_benchmark.objects.dataset`); one named
    "car" holds cars, one named "plane" aircraft; any other folder or file holds meshes that are a
    region each. Raises DataError where there is none, or a file cannot be used.
    """
    found: list[TargetSource] = []
    for place in places:
        there = list(_sources(place))
        number = len(there) if sample is None else min(sample, len(there))
        found += [there[k] for k in np.linspace(0, len(there) - 1, number).astype(int)]
    if not found:
        raise DataError("no mesh is given; give folders of meshes, or files")
    return found


def _sources(place: Path) -> Iterator[TargetSource]:
    if (place / LABELS).is_file():
        labels = read_labels(place).parts
        for item in read_objects(place):
            yield TargetSource(item.key, item.checksum, partial(_labelled, item, labels))
        return
    files = [place]
    if place.is_dir():
        files = sorted(path for path in place.iterdir() if path.suffix.lower() in _SUFFIXES)
    if not files or not files[0].is_file():
        raise DataError(f"{place}: no mesh there; give a folder of {', '.join(_SUFFIXES)} files")
    make = {CARS: car_target, PLANES: plane_target}.get(place.name, whole_target)
    for path in files:
        checksum = hashlib.sha256(path.read_bytes()).hexdigest()
        yield TargetSource(f"{place.stem}/{path.stem}", checksum, _reader(path, checksum, make))


def _reader(path: Path, checksum: str, make: Callable[..., MeshTarget]) -> Callable[[], MeshTarget]:
    def read() -> MeshTarget:
        try:
            vertices, faces, _ = clean_faces(*check_mesh(*load_mesh(path)))
        except DataError as error:
            raise DataError(f"{path}: {error}") from error
        return make(f"{path.parent.name}/{path.stem}", vertices, faces, checksum)

    return read


def _labelled(item: LabelledMesh, labels: Sequence[str]) -> MeshTarget:
    """Furniture: every labelled part is a region."""
    faces = _outward(item.vertices, item.faces)
    regions = {name: item.label == name for name in labels if (item.label == name).any()}
    vertices = FURNITURE_M * item.vertices
    return MeshTarget(item.key, vertices, faces, regions, item.checksum, FINE)


def whole_target(name: str, vertices: np.ndarray, faces: np.ndarray, checksum: str) -> MeshTarget:
    """A mesh that is one region as a whole."""
    vertices = _scaled(vertices, WHOLE_M)
    regions = {"all": np.ones(len(faces), bool)}
    return MeshTarget(name, vertices, _outward(vertices, faces), regions, checksum, FINE)


def car_target(name: str, vertices: np.ndarray, faces: np.ndarray, checksum: str) -> MeshTarget:
    """A car with bonnet, roof and right door, told by the place and normal of the faces."""
    vertices, faces, centre, normal = _divided(vertices, faces)
    low, high = vertices[:, 1].min(), vertices[:, 1].max()
    height = (centre[:, 1] - low) / (high - low)  # 0 to 1
    side = centre[:, 2] / vertices[:, 2].max()  # 1: the right-hand side
    masks = {
        "bonnet": (normal[:, 1] > 0.85)
        & (centre[:, 0] > 0.2) & (centre[:, 0] < 0.45) & (height > 0.4) & (height < 0.85)
        & (np.abs(side) < 0.8),
        "roof": (normal[:, 1] > 0.9) & (height > 0.85) & (np.abs(centre[:, 0]) < 0.3),
        "door": (normal[:, 2] > 0.8)
        & (np.abs(centre[:, 0]) < 0.15) & (height > 0.3) & (height < 0.65) & (side > 0.7),
    }  # fmt: skip
    regions = {part: _largest(faces, mask) for part, mask in masks.items() if mask.any()}
    return MeshTarget(name, CAR_M * vertices, faces, regions, checksum, COARSE)


def plane_target(name: str, vertices: np.ndarray, faces: np.ndarray, checksum: str) -> MeshTarget:
    """An aircraft with the upper side of its right wing, told by the place and normal of faces."""
    vertices, faces, centre, normal = _divided(vertices, faces)
    back, front = vertices[:, 0].min(), vertices[:, 0].max()
    along = (centre[:, 0] - back) / (front - back)  # 0 to 1; the tail's fins lie below 0.25
    side = centre[:, 2] / vertices[:, 2].max()  # 1: the right wing's tip
    mask = (normal[:, 1] > 0.5) & (along > 0.25) & (side > 0.2)
    regions = {"wing": _largest(faces, mask)} if mask.any() else {}
    return MeshTarget(name, PLANE_M * vertices, faces, regions, checksum, COARSE)


def face_components(faces: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """The number (f,) of the connected piece of `mask` (f,) that a face is of; -1 outside."""
    chosen = np.flatnonzero(mask)
    rows = np.repeat(np.arange(len(chosen)), 3)
    shape = (len(chosen), int(faces.max()) + 1)
    uses = coo_matrix((np.ones(len(rows)), (rows, faces[chosen].ravel())), shape).tocsr()
    piece = np.full(len(faces), -1)
    piece[chosen] = connected_components(uses @ uses.T, directed=False)[1]
    return piece


def _largest(faces: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """The connected piece (f,) with most faces."""
    piece = face_components(faces, mask)
    return np.asarray(piece == np.bincount(piece[mask]).argmax())


def _divided(
    vertices: np.ndarray, faces: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """A mesh of size 1 in triangles so small that a region of whole ones has an even border: its
    vertices (v, 3), faces (f, 3), and the faces' middles (f, 3) and outward unit normals (f, 3).

    Doors and wings are modelled in triangles as long as they are; the surface stays as it is.
    """
    vertices, faces = remesh.subdivide_to_size(_scaled(vertices, 1.0), faces, _EDGE)
    vertices, faces, _ = clean_faces(vertices, faces)
    faces = _outward(vertices, faces)
    normals = unit_vectors(triangle_crosses(vertices, faces))
    return vertices, faces, vertices[faces].mean(axis=1), normals


def _scaled(vertices: np.ndarray, size_m: float) -> np.ndarray:
    centre, scale = canonical_transform(vertices)
    return np.asarray(size_m / scale * (vertices - centre))


def _outward(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    return outer_skin(vertices, faces, 4096, np.random.default_rng(0))[0]
