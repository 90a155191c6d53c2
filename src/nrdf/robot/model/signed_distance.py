"""The object as an obstacle: its signed distance on a grid, and a mesh of it.

Nothing is made convex: a distance field has as many holes as the object.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import igl
import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from nrdf.errors import RobotError
from nrdf.geometry.sampling import downsample
from nrdf.geometry.winding import WindingNumber, mesh_winding_numbers

CELL_M = 0.008
MARGIN_M = 0.20
"""How far around the object distances are known; farther away, they are at least about that."""
_BAND = 5.0  # cells around the surface where distances are exact
_COARSE = 4  # nodes between evaluations of the winding number far from the surface
_SPECK = 2  # nodes, of a part apart from all others
_MOST_NODES = 6_000_000
_MOST_POINTS = 30_000
_SAME_M = 0.02  # between a mesh and the scan of what it is of


@dataclass(frozen=True)
class SignedDistanceField:
    """Signed distance (positive outside), m, on a grid in the object's frame.

    corner: (3,) of the first node; cell: m; distance: (nx, ny, nz), gradient (nx, ny, nz, 3).
    vertices (v, 3), faces (f, 3): the surface as a mesh, its faces outward. samples: (s, 3), of the
    surface, about half a cell apart or less. origin: where the shape comes from, in words.
    """

    corner: np.ndarray
    cell: float
    distance: np.ndarray
    vertices: np.ndarray
    faces: np.ndarray
    samples: np.ndarray
    origin: str

    @cached_property
    def _packed(self) -> np.ndarray:
        """Distance and gradient side by side (nodes, 4): one look-up fetches both."""
        gradient = np.stack(np.gradient(self.distance, self.cell), axis=-1)
        both = np.concatenate([self.distance[..., None], gradient], axis=-1)
        return np.ascontiguousarray(both.reshape(-1, 4).astype(np.float32))

    @cached_property
    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest coordinates of the surface."""
        return self.samples.min(axis=0), self.samples.max(axis=0)

    def distances(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Signed distances (...,) of points (..., 3) in the object's frame, and gradients.

        To first order around the nearest node. Beyond the grid, of its nearest node, which is less
        than the true distance.
        """
        shape = np.array(self.distance.shape)
        scaled = (points - self.corner) / self.cell
        node = np.rint(scaled)
        np.clip(node, 0, shape - 1, out=node)
        index = (node[..., 0] * shape[1] + node[..., 1]) * shape[2] + node[..., 2]
        found = self._packed[index.astype(np.int64)]
        offset = np.clip(scaled - node, -0.5, 0.5) * self.cell
        gradient = found[..., 1:]
        return found[..., 0] + np.einsum("...a,...a->...", gradient, offset), gradient


def distance_field_from_points(points: np.ndarray, normals: np.ndarray) -> SignedDistanceField:
    """A signed distance field from an oriented cloud (n, 3), m: its winding number's level set.

    The generalised winding number tells inside from outside, holes in the scan or not; marching
    cubes make a mesh of its level set, and the distance is that from the points and from the mesh
    drawn onto the points' planes, so that the surface is where it was scanned. Raises RobotError
    for an object too large for its cells.
    """
    kept = downsample(points, _MOST_POINTS, np.random.default_rng(0))
    points = np.ascontiguousarray(points[kept], dtype=np.float64)
    normals = np.ascontiguousarray(normals[kept], dtype=np.float64)
    tree = cKDTree(points)
    grid = _Grid.around(points)
    value = grid.filled(tree, WindingNumber(points, normals))
    vertices, faces = grid.level_set(value)
    # Where points are sparse the level set bulges; the nearest point's plane does not.
    far, nearest = tree.query(vertices, 4)
    offset = vertices[:, None] - points[nearest]
    height = np.einsum("vka,vka->vk", offset, normals[nearest])
    weight = np.exp(-((far / np.maximum(far[:, :1], 1e-4)) ** 2))
    drop = (weight * height).sum(axis=1) / weight.sum(axis=1)
    direction = normals[nearest[:, 0]]
    drop = np.clip(drop, -1.5 * grid.cell, 1.5 * grid.cell)
    vertices = vertices - drop[:, None] * direction
    origin = f"winding number of {len(points)} scanned points, cells of {1e3 * grid.cell:.0f} mm"
    return grid.distance_field(value, vertices, faces, np.concatenate([points, vertices]), origin)


def distance_field_from_mesh(
    vertices: np.ndarray, faces: np.ndarray, origin: str = "mesh"
) -> SignedDistanceField:
    """A signed distance field from a mesh with outward faces, m.

    Parts may overlap, and small holes do no harm.
    """
    import trimesh

    mesh = trimesh.Trimesh(vertices, faces, process=False)
    grid = _Grid.around(vertices)
    wanted = int(np.clip(mesh.area / (0.4 * grid.cell) ** 2, 2_000, 200_000))
    samples = np.asarray(trimesh.sample.sample_surface(mesh, wanted, seed=0)[0])
    tree = cKDTree(samples)
    value = grid.filled(tree, lambda nodes: mesh_winding_numbers(vertices, faces, nodes))
    return grid.distance_field(value, vertices, faces, samples, origin)


def distance_field_from_file(path: str | Path, points: np.ndarray) -> SignedDistanceField:
    """A signed distance field from a mesh file, m, of the object whose points (n, 3) are given.

    Raises DataError for a file that cannot be read, and RobotError for a mesh that is not where
    the points are.
    """
    from nrdf.geometry.mesh import outer_skin
    from nrdf.io.formats.mesh_file import load_mesh

    vertices, faces = load_mesh(path)
    faces, _ = outer_skin(vertices, faces, 2000, np.random.default_rng(0))
    distance_field = distance_field_from_mesh(vertices, faces, f"mesh {Path(path).name}")
    far = float(np.median(np.abs(distance_field.distances(points)[0])))
    if far > _SAME_M:
        raise RobotError(
            f"the mesh {path} is {1e3 * far:.0f} mm from the job's points, in the middle: it must "
            "be in metres, in the job's frame"
        )
    return distance_field


def _without_specks(value: np.ndarray) -> np.ndarray:
    """Winding numbers without nodes that stand alone, or in twos, on the wrong side: there a sum of
    many points fails."""
    for side in (1.0, 0.0):
        labels, count = ndimage.label((value > 0.5) == (side > 0.5))
        size = np.bincount(labels.ravel(), minlength=count + 1)
        value = np.where((size <= _SPECK)[labels] & (labels > 0), 1.0 - side, value)
    return value


@dataclass(frozen=True)
class _Grid:
    corner: np.ndarray
    cell: float
    shape: tuple[int, int, int]

    @staticmethod
    def around(points: np.ndarray) -> _Grid:
        low, high = points.min(axis=0) - MARGIN_M, points.max(axis=0) + MARGIN_M
        cell = max(CELL_M, float((np.prod(high - low) / _MOST_NODES) ** (1 / 3)))
        if cell > 4.0 * CELL_M:
            size = " x ".join(f"{x:.2f}" for x in np.ptp(points, axis=0))
            raise RobotError(
                f"the object measures {size} m, too large to be worked by one arm: is its unit "
                "right, and is it alone in the scan?"
            )
        nx, ny, nz = (np.ceil((high - low) / cell).astype(int) + 1).tolist()
        return _Grid(low, cell, (nx, ny, nz))

    def nodes(self, index: np.ndarray) -> np.ndarray:
        """Positions (m, 3) of nodes given by flat index (m,)."""
        return self.corner + self.cell * np.stack(np.unravel_index(index, self.shape), axis=1)

    def filled(self, tree: cKDTree, winding: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Winding numbers on all nodes: all of them near the surface, a few elsewhere."""
        near = self._near(tree, 2.5)
        coarse = [np.arange(0, count + _COARSE, _COARSE) for count in self.shape]
        nodes = np.stack(np.meshgrid(*coarse, indexing="ij"), axis=-1).reshape(-1, 3)
        value = winding(self.corner + self.cell * nodes).reshape([len(axis) for axis in coarse])
        nearest = [(np.arange(count) + _COARSE // 2) // _COARSE for count in self.shape]
        value = value[np.ix_(*nearest)]
        index = np.flatnonzero(near)
        value.ravel()[index] = winding(self.nodes(index))
        return _without_specks(value)

    def _near(self, tree: cKDTree, cells: float) -> np.ndarray:
        """Nodes within a number of cells of the surface's points, roughly."""
        hit = np.ones(self.shape, bool)
        at = np.rint((tree.data - self.corner) / self.cell).astype(int)
        hit[tuple(at.T)] = False
        return np.asarray(ndimage.distance_transform_edt(hit) <= cells)

    def level_set(self, value: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        nx, ny, nz = self.shape
        axes = [self.corner[k] + self.cell * np.arange(self.shape[k]) for k in range(3)]
        z, y, x = np.meshgrid(axes[2], axes[1], axes[0], indexing="ij")  # x runs fastest
        nodes = np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
        flat = np.ascontiguousarray(value.transpose(2, 1, 0).ravel())
        vertices, faces, _ = igl.marching_cubes(flat, nodes, nx, ny, nz, 0.5)
        if not len(faces):
            raise RobotError(
                "the scan encloses nothing: are its normals turned outwards, and is it whole?"
            )
        faces = np.asarray(faces)[:, ::-1]  # igl winds them inwards where values grow inwards
        return np.asarray(vertices), faces

    def distance_field(
        self,
        value: np.ndarray,
        vertices: np.ndarray,
        faces: np.ndarray,
        samples: np.ndarray,
        origin: str,
    ) -> SignedDistanceField:
        tree = cKDTree(samples)
        hit = np.ones(self.shape, bool)
        hit[tuple(np.rint((samples - self.corner) / self.cell).astype(int).T)] = False
        away = ndimage.distance_transform_edt(hit) * self.cell
        # Rough distances are off by up to a cell's diagonal: less is safe.
        distance = np.maximum(away - self.cell, 0.0)
        index = np.flatnonzero(away.ravel() < _BAND * self.cell)
        distance.ravel()[index] = tree.query(self.nodes(index))[0]
        signed = np.where(value > 0.5, -distance, distance)
        return SignedDistanceField(self.corner, self.cell, signed, vertices, faces, samples, origin)
