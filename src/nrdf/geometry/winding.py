"""Winding numbers of oriented points or of a mesh: 1 inside, 0 outside.

Some input would crash libigl, so it is changed or refused here. libigl's octree halves cells until
each holds one point: two equal or nearly equal points overflow its stack. Its mesh tree reads
invalid memory if there is no face, if a face names a vertex that does not exist, or if coordinates
exceed single precision. So every shape is scaled to unit size, and points are rounded to a lattice
and taken once each: 22 halvings separate any two of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import igl
import numpy as np
from scipy.spatial import cKDTree

from nrdf.errors import CloudError
from nrdf.geometry.mesh import check_mesh

_NEIGHBOURS = 17
_BITS = 21  # of a place's number along each axis: three of them fit in 63
_LATTICE = float((1 << _BITS) - 1)  # steps along the longest side: 0.5 µm each of 1 m
_FARTHEST = 1e6  # longest sides away, from where every winding number is 0


class WindingNumber:
    """The generalised winding number of an oriented cloud (Barill et al., 2018).

    points: (n, 3), any unit; normals: (n, 3), outward. About 1 inside and 0 outside, holes in the
    scan or not; half-way on the surface. Points nearer to each other than a two-millionth of the
    longest side count as one. Raises CloudError for points and normals that do not fit each other,
    are none, or are not finite.
    """

    def __init__(self, points: np.ndarray, normals: np.ndarray) -> None:
        points = _finite(points)
        normals = _finite(normals)
        if points.shape != normals.shape or not len(points):
            raise CloudError(
                f"points {points.shape} and normals {normals.shape} must be as many, and some"
            )
        self._cube = _Cube.around(points)
        self._points, self._normals = _on_lattice(self._cube(points), normals)
        # The disc that a point stands for, from its neighbours of the same side.
        count = min(_NEIGHBOURS, len(self._points))
        distance, near = cKDTree(self._points).query(self._points, np.arange(1, count + 1))
        alike = np.einsum("nka,na->nk", self._normals[near], self._normals) > 0.5
        self._area = np.pi * distance[:, -1] ** 2 / np.maximum(alike.sum(axis=1) - 0.5, 1.0)

    def __call__(self, places: np.ndarray, order: int = 2) -> np.ndarray:
        """Winding numbers (m,) at places (m, 3), in the points' unit.

        order: of the expansion that stands for points far away; 1 is four times faster, and enough
        to tell inside from outside. Raises CloudError for places that are not finite.
        """
        places = self._cube(_finite(places))
        return np.asarray(
            igl.fast_winding_number(self._points, self._normals, self._area, places, order)
        )


class MeshWindingNumber:
    """The generalised winding number of the mesh of outward `faces` (f, 3), made ready once.

    1 inside a closed surface, 0 outside (Jacobson et al., 2013; fast form of Barill et al., 2018).
    Raises DataError for no mesh.
    """

    def __init__(self, vertices: np.ndarray, faces: np.ndarray) -> None:
        vertices, faces = check_mesh(vertices, faces)
        self._cube = _Cube.around(vertices)
        self._tree = igl.FastWindingNumberBVH()
        self._tree.init(self._cube(vertices), faces)

    def __call__(self, places: np.ndarray) -> np.ndarray:
        """Winding numbers (m,) at places (m, 3), in the vertices' unit. Raises CloudError for
        places that are not finite."""
        places = self._cube(_finite(places))
        return np.asarray(self._tree.winding_number(places)) if len(places) else np.zeros(0)


def mesh_winding_numbers(vertices: np.ndarray, faces: np.ndarray, places: np.ndarray) -> np.ndarray:
    """`MeshWindingNumber` at places (m, 3) asked for once."""
    return MeshWindingNumber(vertices, faces)(places)


@dataclass(frozen=True)
class _Cube:
    """Where a shape is brought to: 0 to 1 along its longest side, whatever its size."""

    largest: float
    low: np.ndarray
    side: float

    @staticmethod
    def around(points: np.ndarray) -> _Cube:
        largest = float(np.abs(points).max()) or 1.0  # dividing first keeps sides finite
        low, high = (points / largest).min(axis=0), (points / largest).max(axis=0)
        return _Cube(largest, low, float((high - low).max()) or 1.0)

    def __call__(self, places: np.ndarray) -> np.ndarray:
        with np.errstate(over="ignore"):  # an infinite distance is far, too
            brought = (places / self.largest - self.low) / self.side
        return np.ascontiguousarray(np.clip(brought, -_FARTHEST, _FARTHEST))


def _finite(places: np.ndarray) -> np.ndarray:
    places = np.asarray(places, dtype=np.float64)
    if places.ndim != 2 or places.shape[1] != 3 or not np.isfinite(places).all():
        raise CloudError(f"points and normals must be (n, 3), not {places.shape}, and finite")
    return places


def _on_lattice(points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) of the unit cube at the nearest places of the lattice, each once, and the means
    (k, 3) of the normals there: the two sides of a sheet without thickness cancel out."""
    step = np.rint(points * _LATTICE).astype(np.int64)
    key = (step[:, 0] << 2 * _BITS) | (step[:, 1] << _BITS) | step[:, 2]
    _, first, which, count = np.unique(
        key, return_index=True, return_inverse=True, return_counts=True
    )
    if len(first) == len(points):  # in the order given
        return step / _LATTICE, normals
    total = [np.bincount(which, normals[:, axis], len(first)) for axis in range(3)]
    return step[first] / _LATTICE, np.stack(total, axis=1) / count[:, None]
