"""A point cloud, and the files it is read from and written to."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from nrdf import ply
from nrdf.errors import CloudError
from nrdf.formats import reader_of

logger = logging.getLogger(__name__)

MOST_DROPPED = 0.01  # largest share of points that may have NaN or infinite coordinates
FLATTEST = 1e-3  # least ratio of the smallest to the largest extent (standard deviations)


@dataclass(frozen=True)
class PointCloud:
    """Points on an object's surface.

    points: (n, 3) float64, finite; normals: (n, 3) float64, unit length, outward, or None;
    unit: "m", "mm", … or None where the file does not say; frame: name of the coordinate frame, or
    None.
    """

    points: np.ndarray
    normals: np.ndarray | None = None
    unit: str | None = None
    frame: str | None = None

    def __post_init__(self) -> None:
        points = np.ascontiguousarray(self.points, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 3:
            raise CloudError(f"points must have the shape (n, 3), not {points.shape}")
        object.__setattr__(self, "points", points)
        if self.normals is not None:
            normals = np.ascontiguousarray(self.normals, dtype=np.float64)
            if normals.shape != points.shape:
                raise CloudError(f"{normals.shape} normals do not fit {points.shape} points")
            object.__setattr__(self, "normals", normals)

    def __len__(self) -> int:
        return len(self.points)

    def select(self, index: np.ndarray) -> PointCloud:
        """The points at `index`, integers (k,) or a mask (n,), with their normals."""
        normals = None if self.normals is None else self.normals[index]
        return replace(self, points=self.points[index], normals=normals)


def read_cloud(path: str | Path, mesh_samples: int = 30_000) -> PointCloud:
    """Point cloud of the file `path`; the format is told from its content and its name's ending.

    A mesh (faces in a PLY, OFF, OBJ or STL file) is sampled: `mesh_samples` points spread evenly
    over what is visible from outside, always the same ones, with outward normals; its vertices
    would be a poor cloud. With `mesh_samples` 0 the vertices are taken all the same. Normals in
    the file are used as they are, brought to unit length; they are left out if some are missing.
    A PLY comment ``unit mm`` or ``frame name`` sets the unit or the frame.

    Raises CloudError if the file is missing, unreadable, truncated, in no known format, or empty,
    or if 1 % or more of its points have NaN or infinite coordinates; fewer are dropped, with a
    warning that counts them.
    """
    path = Path(path)
    try:
        with open(path, "rb") as file:
            start = file.read(512)
        if not start:
            raise CloudError(f"{path}: the file is empty")
        cloud = PointCloud(**vars(reader_of(path, start)(path, mesh_samples)))
    except OSError as error:
        raise CloudError(f"cannot read {path}: {error.strerror or error}") from error
    return _clean(path, cloud)


def _clean(path: Path, cloud: PointCloud) -> PointCloud:
    """Drop the few points that are not finite, bring normals to unit length, or refuse."""
    if len(cloud) == 0:
        raise CloudError(f"{path}: the cloud holds no points")
    finite = np.isfinite(cloud.points).all(axis=1)
    missing = int((~finite).sum())
    if missing >= MOST_DROPPED * len(cloud) and missing:
        raise CloudError(
            f"{path}: {missing} of {len(cloud)} points have NaN or infinite coordinates; under "
            f"{MOST_DROPPED:.0%} would be dropped: remove them, or export the cloud again"
        )
    if missing:
        logger.warning("%s: dropped %d points with NaN or infinite coordinates", path, missing)
        cloud = cloud.select(finite)
    if cloud.normals is None:
        return cloud
    length = np.linalg.norm(cloud.normals, axis=1, keepdims=True)
    if not (np.isfinite(length) & (length > 1e-6)).all():
        logger.warning("%s: some normals are zero or not finite; all are left out", path)
        return replace(cloud, normals=None)
    return replace(cloud, normals=cloud.normals / length)


def check_cloud(cloud: PointCloud, minimum_points: int) -> None:
    """Raise CloudError unless `cloud` has `minimum_points` points that span three dimensions."""
    if len(cloud) == 0:
        raise CloudError("the cloud holds no points")
    if len(cloud) < minimum_points:
        raise CloudError(
            f"the cloud has {len(cloud)} points; at least {minimum_points} are needed: "
            "scan or sample it more densely"
        )
    if not np.isfinite(cloud.points).all():
        raise CloudError("the cloud has NaN or infinite coordinates; remove those points")
    offset = cloud.points - cloud.points.mean(axis=0)
    largest = float(np.abs(offset).max())
    if largest == 0.0 or largest <= 1e-12 * float(np.abs(cloud.points).max()):
        raise CloudError("all points of the cloud coincide; a cloud of a whole object is needed")
    offset = offset / largest
    extent = np.sqrt(np.maximum(np.linalg.eigvalsh(offset.T @ offset / len(offset)), 0.0))[::-1]
    kind = "collinear" if extent[1] < FLATTEST * extent[0] else "flat"
    if extent[2] < FLATTEST * extent[0]:
        raise CloudError(
            f"the cloud is {kind}: its smallest extent is {extent[2] / extent[0]:.1e} of its "
            f"largest, at least {FLATTEST:g} is needed; a cloud of a whole object is needed"
        )


def write_cloud(
    path: str | Path,
    cloud: PointCloud,
    colours: np.ndarray | None = None,
    scalars: Mapping[str, np.ndarray] | None = None,
) -> None:
    """Write `cloud` as binary PLY, all of it or nothing.

    colours: (n, 3) uint8, red, green, blue; scalars: further properties by name, each (n,), for
    instance ``{"confidence": …}``. Raises OutputError if the file cannot be written, CloudError if
    an array does not fit or a name is no PLY property name.
    """
    columns = {name: cloud.points[:, i] for i, name in enumerate("xyz")}
    if cloud.normals is not None:
        columns |= {f"n{a}": cloud.normals[:, i].astype("f4") for i, a in enumerate("xyz")}
    if colours is not None:
        colours = np.asarray(colours)
        if colours.shape != cloud.points.shape or colours.dtype != np.uint8:
            raise CloudError(
                f"colours must be ({len(cloud)}, 3) of uint8, not {colours.shape} of "
                f"{colours.dtype}"
            )
        columns |= {name: colours[:, i] for i, name in enumerate(("red", "green", "blue"))}
    for name, values in (scalars or {}).items():
        values = np.asarray(values)
        if values.shape != (len(cloud),):
            raise CloudError(f"'{name}' must have the shape ({len(cloud)},), not {values.shape}")
        if not (name.isidentifier() and name.isascii()) or name in columns:
            raise CloudError(f"'{name}' is no name for a further PLY property")
        columns[name] = values.astype("i4" if values.dtype.kind in "bi" else "f4")
    comments = [f"unit {cloud.unit}"] if cloud.unit else []
    comments += [f"frame {cloud.frame}"] if cloud.frame else []
    ply.write_rows(Path(path), columns, comments)
