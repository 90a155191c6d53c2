"""A point cloud, and the files it is read from and written to."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from nrdf.errors import CloudError, DataError
from nrdf.geometry.mesh import MAX_COORDINATE, Mesh, check_coordinate_range
from nrdf.geometry.units import METRES
from nrdf.io import ply
from nrdf.io.files import open_file
from nrdf.io.formats.detect import detect_reader

logger = logging.getLogger(__name__)

MAX_DROPPED = 0.01  # largest share of points that may have NaN or infinite coordinates
MIN_SIDE = 1e-9  # longest side of a cloud's bounding box, at least
MIN_FLATNESS = 1e-3  # least ratio of the smallest to the largest extent (standard deviations)


@dataclass(frozen=True)
class PointCloud:
    """Points on an object's surface.

    Attributes:
        points: (n, 3) float64, finite.
        normals: (n, 3) float64, outward, or None; brought to unit length.
        unit: "m", "mm", … or None where the file does not say.
        frame: name of the coordinate frame, or None.
        colours: (n, 3) uint8, or None.
        intensity: (n,) float32, or None.
        sensors: (s, 3) float64, where the sensors stood that saw the points, in the same frame
            and unit; None if unknown.
        mesh: what the points were sampled from, in the same frame and unit; None where there is
            none. It stays the whole mesh when points are selected.
    """

    points: np.ndarray
    normals: np.ndarray | None = None
    unit: str | None = None
    frame: str | None = None
    colours: np.ndarray | None = None
    intensity: np.ndarray | None = None
    sensors: np.ndarray | None = None
    mesh: Mesh | None = None

    def __post_init__(self) -> None:
        points = np.ascontiguousarray(self.points, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 3:
            raise CloudError(f"points must have the shape (n, 3), not {points.shape}")
        object.__setattr__(self, "points", points)
        if self.normals is not None:
            normals = np.ascontiguousarray(self.normals, dtype=np.float64)
            if normals.shape != points.shape:
                raise CloudError(f"{normals.shape} normals do not fit {points.shape} points")
            object.__setattr__(self, "normals", _of_unit_length(normals))
        if self.colours is not None and np.shape(self.colours) != points.shape:
            raise CloudError(f"{np.shape(self.colours)} colours do not fit {points.shape} points")
        if self.intensity is not None and np.shape(self.intensity) != points.shape[:1]:
            raise CloudError(
                f"{np.shape(self.intensity)} intensities do not fit {points.shape} points"
            )
        if self.sensors is not None:
            sensors = np.atleast_2d(np.asarray(self.sensors, dtype=np.float64))
            if sensors.size and (sensors.ndim != 2 or sensors.shape[1] != 3):
                raise CloudError(f"sensors must have the shape (s, 3), not {sensors.shape}")
            sensors = sensors.reshape(-1, 3)
            wrong = sensors[~(np.abs(sensors) <= MAX_COORDINATE)]
            if len(wrong):
                raise CloudError(
                    f"a sensor's place is {wrong[0]:.3g} along an axis; give numbers up to "
                    f"{MAX_COORDINATE:g}, or leave out what is not known"
                )
            object.__setattr__(self, "sensors", sensors if len(sensors) else None)

    def __len__(self) -> int:
        return len(self.points)

    def select(self, index: np.ndarray) -> PointCloud:
        """The points at `index`, integers (k,) or a mask (n,), with all that belongs to them."""
        owned = {name: getattr(self, name) for name in ("normals", "colours", "intensity")}
        kept = {name: values[index] for name, values in owned.items() if values is not None}
        return replace(self, points=self.points[index], **kept)


def read_cloud(
    path: str | Path, mesh_samples: int = 30_000, topic: str | None = None
) -> PointCloud:
    """Point cloud of a file; the format is told from its content and its name's ending.

    A mesh (faces in a PLY, OFF, OBJ, STL or GLB file) is sampled: points spread evenly over what
    is visible from outside, always the same ones, with outward normals. It is kept as
    `PointCloud.mesh`; its vertices would be a poor cloud. Normals in the file are used as they
    are, brought to unit length; they are left out if some are missing. A PLY comment `unit mm`,
    `frame name` or `sensor x y z` (one each) sets the unit, the frame, or where a sensor stood,
    and so does a PCD file's VIEWPOINT.

    Args:
        path: the file; or the folder of a ROS 2 bag.
        mesh_samples: points that a mesh is sampled to; with 0 its vertices are taken.
        topic: of a ROS 2 bag (a folder, or an MCAP or SQLite file), whose first cloud is read. It
            may be left out where only one topic has clouds.

    Raises:
        CloudError: the file is missing, no regular file (a pipe, say), unreadable, truncated, in
            no known format, or empty; has coordinates above 1e12; holds more than its header
            claims; or 1 % or more of its points have NaN or infinite coordinates. Fewer are
            dropped, with a warning that counts them. In PCD files and bags such points mean that
            a pixel measured nothing: any number of them is dropped.
    """
    path = Path(path)
    start = b""
    if not (path / "metadata.yaml").is_file():  # else the folder of a bag
        with open_file(path, CloudError) as file:
            start = file.read(512)
        if not start:
            raise CloudError(f"{path}: the file is empty")
    try:
        raw = detect_reader(path, start, topic)(path, mesh_samples)
    except OSError as error:
        raise CloudError(f"cannot read {path}: {error.strerror or error}") from error
    values = vars(raw)
    gaps = values.pop("gaps")
    try:
        cloud = PointCloud(**values)
    except CloudError as error:
        raise CloudError(f"{path}: {error}") from None
    return _clean(path, cloud, gaps)


def _clean(path: Path, cloud: PointCloud, gaps: bool) -> PointCloud:
    """Drop the few points that are not finite (or many, where those are gaps), bring normals to
    unit length, or refuse."""
    if len(cloud) == 0:
        raise CloudError(f"{path}: the cloud holds no points")
    finite = np.isfinite(cloud.points).all(axis=1)
    missing = int((~finite).sum())
    if gaps and missing == len(cloud):
        raise CloudError(f"{path}: none of its {len(cloud)} points was measured: all are NaN")
    if missing >= MAX_DROPPED * len(cloud) and missing and not gaps:
        raise CloudError(
            f"{path}: {missing} of {len(cloud)} points have NaN or infinite coordinates; under "
            f"{MAX_DROPPED:.0%} would be dropped: remove them, or export the cloud again"
        )
    if missing:
        level = logging.INFO if gaps else logging.WARNING
        logger.log(level, "%s: dropped %d points with NaN or infinite coordinates", path, missing)
        cloud = cloud.select(finite)
    try:
        check_coordinate_range(cloud.points)
    except DataError as error:
        raise CloudError(f"{path}: {error}") from error
    return drop_partial_normals(str(path), cloud)


def drop_partial_normals(name: str, cloud: PointCloud) -> PointCloud:
    """The cloud, whose normals have unit length, or without them, with a warning, where some are
    missing. name: what it is, for the warning."""
    if cloud.normals is not None and not _has_unit_length(cloud.normals).all():
        logger.warning("%s: some normals are zero or not finite; all are left out", name)
        return replace(cloud, normals=None)
    return cloud


def _of_unit_length(normals: np.ndarray) -> np.ndarray:
    """Normals (n, 3) brought to unit length; what has none stays."""
    good = _has_unit_length(normals)
    if good.all():
        return normals
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        # The largest component first: squares of what is very large or small are lost.
        scaled = normals / np.abs(normals).max(axis=1, keepdims=True)
        scaled /= np.linalg.norm(scaled, axis=1, keepdims=True)
    usable = ~good & np.isfinite(scaled).all(axis=1) & (np.abs(normals).max(axis=1) > 1e-6)
    return np.where(usable[:, None], scaled, normals)


def _has_unit_length(normals: np.ndarray) -> np.ndarray:
    with np.errstate(over="ignore", invalid="ignore"):
        return np.abs(np.einsum("na,na->n", normals, normals) - 1.0) < 1e-6


def in_metres(cloud: PointCloud, unit: str) -> PointCloud:
    """The cloud, whose coordinates are in `unit`, in metres."""
    length = METRES[unit]
    sensors = None if cloud.sensors is None else cloud.sensors * length
    mesh = None if cloud.mesh is None else cloud.mesh.scaled(length)
    return replace(cloud, points=cloud.points * length, sensors=sensors, unit="m", mesh=mesh)


def check_coordinates(cloud: PointCloud) -> None:
    """Raise CloudError unless all that is computed of `cloud` stays within what numbers hold.

    Points must be finite, none beyond 1e12, their longest side at least 1e-9 and a millionth of a
    millionth of their distance from the origin; normals must have a length.
    """
    if not np.isfinite(cloud.points).all():
        raise CloudError("the cloud has NaN or infinite coordinates; remove those points")
    try:
        check_coordinate_range(cloud.points)
    except DataError as error:
        raise CloudError(f"the cloud {error}") from error
    if not len(cloud):
        return
    side = float(np.ptp(cloud.points, axis=0).max())
    if side <= 1e-12 * float(np.abs(cloud.points).max()):
        raise CloudError("all points of the cloud coincide; a cloud of a whole object is needed")
    if side < MIN_SIDE:
        raise CloudError(
            f"the cloud's longest side is {side:.3g}; at least {MIN_SIDE:g} is needed: give it in "
            "a smaller unit"
        )
    if cloud.normals is not None:
        missing = int((~_has_unit_length(cloud.normals)).sum())
        if missing:
            raise CloudError(
                f"{missing} of the cloud's {len(cloud)} normals are zero or not finite; give all "
                "of them, or none: they are estimated then"
            )


def check_cloud(cloud: PointCloud, minimum_points: int) -> None:
    """Raise CloudError unless `cloud` has `minimum_points` points that span three dimensions."""
    if len(cloud) == 0:
        raise CloudError("the cloud holds no points")
    if len(cloud) < minimum_points:
        raise CloudError(
            f"the cloud has {len(cloud)} points; at least {minimum_points} are needed: "
            "scan or sample it more densely"
        )
    check_coordinates(cloud)
    offset = cloud.points - cloud.points.mean(axis=0)
    largest = float(np.abs(offset).max())
    offset = offset / largest
    extent = np.sqrt(np.maximum(np.linalg.eigvalsh(offset.T @ offset / len(offset)), 0.0))[::-1]
    kind = "collinear" if extent[1] < MIN_FLATNESS * extent[0] else "flat"
    if extent[2] < MIN_FLATNESS * extent[0]:
        raise CloudError(
            f"the cloud is {kind}: its smallest extent is {extent[2] / extent[0]:.1e} of its "
            f"largest, at least {MIN_FLATNESS:g} is needed; a cloud of a whole object is needed"
        )


def write_cloud(
    path: str | Path,
    cloud: PointCloud,
    colours: np.ndarray | None = None,
    scalars: Mapping[str, np.ndarray] | None = None,
) -> None:
    """Write a cloud as binary PLY, all of it or nothing.

    Args:
        path: the file, replaced whole.
        cloud: what is written.
        colours: (n, 3) uint8, red, green, blue, instead of the cloud's own.
        scalars: further properties by name, each (n,), for instance `{"confidence": …}`.

    Raises:
        OutputError: the file cannot be written.
        CloudError: an array does not fit, or a name is no PLY property name.
    """
    columns = {name: cloud.points[:, i] for i, name in enumerate("xyz")}
    if cloud.normals is not None:
        columns |= {f"n{a}": cloud.normals[:, i].astype("f4") for i, a in enumerate("xyz")}
    colours = cloud.colours if colours is None else colours
    if colours is not None:
        colours = np.asarray(colours)
        if colours.shape != cloud.points.shape or colours.dtype != np.uint8:
            raise CloudError(
                f"colours must be ({len(cloud)}, 3) of uint8, not {colours.shape} of "
                f"{colours.dtype}"
            )
        columns |= {name: colours[:, i] for i, name in enumerate(("red", "green", "blue"))}
    if cloud.intensity is not None:
        scalars = {"intensity": cloud.intensity, **(scalars or {})}
    for name, values in (scalars or {}).items():
        values = np.asarray(values)
        if values.shape != (len(cloud),):
            raise CloudError(f"'{name}' must have the shape ({len(cloud)},), not {values.shape}")
        if not (name.isidentifier() and name.isascii()) or name in columns:
            raise CloudError(f"'{name}' is no name for a further PLY property")
        columns[name] = values.astype("i4" if values.dtype.kind in "bi" else "f4")
    comments = [f"unit {cloud.unit}"] if cloud.unit else []
    comments += [f"frame {cloud.frame}"] if cloud.frame else []
    if cloud.sensors is not None:
        comments += ["sensor " + " ".join(f"{v:.9g}" for v in place) for place in cloud.sensors]
    ply.write_ply(Path(path), columns, comments)
