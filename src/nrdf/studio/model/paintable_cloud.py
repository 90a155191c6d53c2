"""An object as it is shown and painted on: a model's working points, and their surface."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from nrdf.field.cloud_encoder import WORKING_POINTS
from nrdf.geometry.mesh import Mesh
from nrdf.geometry.normals import estimate_normals
from nrdf.geometry.sampling import distinct_points, downsample
from nrdf.geometry.simplify import simplified
from nrdf.io.cloud import PointCloud
from nrdf.studio.model.painting import Canvas
from nrdf.surface.given_surface import GivenSurface, given_surface
from nrdf.surface.object_mesh import object_mesh
from nrdf.surface.region_mesh import RegionMesh, region_mesh
from nrdf.surface.surface import Surface
from nrdf.surface.target_mesh import TargetMesh

SHOWN_FACES = 200_000
"""Triangles of an object that a browser draws without a stutter."""
_USUAL_RADIUS_M = 0.025
_MOST_REGIONS = 12  # that are kept


class PaintableCloud:
    """A cloud to be shown and painted on.

    cloud: n points, m. points, normals: (k, 3) of the shown ones, which are a model's working
    points; shown: (k,) their indices.
    """

    def __init__(self, cloud: PointCloud) -> None:
        self.cloud = cloud
        shown = downsample(cloud.points, WORKING_POINTS, np.random.default_rng(0))
        sides = None if cloud.normals is None else cloud.normals[shown]
        self.shown = shown[distinct_points(cloud.points[shown], sides)]
        self.points = cloud.points[self.shown]
        given = cloud.normals
        self.normals = estimate_normals(self.points) if given is None else given[self.shown]
        self.surface = Surface(self.points, self.normals)
        self._meshes: dict[float | None, TargetMesh] = {}
        self._regions: dict[tuple[bytes, float, int], RegionMesh] = {}
        self.low, self.high = self.points.min(axis=0), self.points.max(axis=0)

    @property
    def longest_side(self) -> float:
        """The longest side of the bounding box, m."""
        return float((self.high - self.low).max())

    @cached_property
    def canvas(self) -> Canvas:
        """The shown points, to be painted on."""
        return Canvas(self.surface)

    @cached_property
    def mesh(self) -> Mesh | None:
        """The object's mesh, m, of at most `SHOWN_FACES` triangles; None for a scan."""
        given = self.cloud.mesh
        if given is None:
            return None
        return Mesh(*simplified(given.vertices, given.faces, SHOWN_FACES))

    @cached_property
    def given(self) -> GivenSurface:
        """The object as it was given, to measure tool paths against."""
        return given_surface(self._with_normals)

    def surface_for(self, tool_radius_m: float | None = None) -> TargetMesh:
        """The surface that paths of a tool are planned on; without one, that which there is.

        Raises ProcessError where no mesh can be made.
        """
        if tool_radius_m is None and self._meshes:
            return next(iter(self._meshes.values()))
        radius = tool_radius_m or _USUAL_RADIUS_M
        key = None if self.cloud.mesh is not None else radius  # an own mesh fits any tool
        if key not in self._meshes:
            self._meshes = {key: object_mesh(self._with_normals, radius)}
        return self._meshes[key]

    def region(self, mask: np.ndarray, tool_radius_m: float) -> RegionMesh:
        """A mask of the shown points (k,) as a part of the object's mesh, for a tool.

        Raises ProcessError where no mesh can be made, or nothing of the region is left on it.
        """
        mesh = self.surface_for(tool_radius_m)
        key = (np.packbits(mask).tobytes(), tool_radius_m, id(mesh))
        if key not in self._regions:  # numbers of a process change more often than its region
            kept = list(self._regions.items())[1 - _MOST_REGIONS :]
            made = region_mesh(mesh, self.points, self.normals, mask.astype(float), tool_radius_m)
            self._regions = {**dict(kept), key: made}
        return self._regions[key]

    @cached_property
    def _with_normals(self) -> PointCloud:
        normals = (
            self.normals[self._nearest_shown] if self.cloud.normals is None else self.cloud.normals
        )
        return replace(self.cloud, normals=normals)

    @cached_property
    def _nearest_shown(self) -> np.ndarray:
        return np.asarray(cKDTree(self.points).query(self.cloud.points)[1])

    def to_all(self, mask: np.ndarray) -> np.ndarray:
        """A mask of the shown points (k,) as one of all points (n,), by the nearest shown point."""
        return mask if len(self.shown) == len(self.cloud) else mask[self._nearest_shown]

    def to_shown(self, values: np.ndarray) -> np.ndarray:
        """Values of all points (n, ...) as those of the shown ones (k, ...)."""
        return values[self.shown]
