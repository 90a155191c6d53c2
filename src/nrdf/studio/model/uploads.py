"""Files that a browser sends, and objects that come with the package, as clouds in metres."""

from __future__ import annotations

import tempfile
from pathlib import Path, PurePath

import numpy as np

from nrdf.bundled import REFERENCE, TARGETS, bundled_chair
from nrdf.errors import CloudError, NrdfError
from nrdf.field.cloud_encoder import MINIMUM_POINTS, WORKING_POINTS
from nrdf.geometry.sampling import downsample
from nrdf.io.cloud import PointCloud, check_cloud, in_metres, read_cloud
from nrdf.process.bound_knowledge import known_unit

LARGEST_UPLOAD = 128 << 20
ENDINGS = (
    ".ply", ".pcd", ".xyz", ".xyzn", ".txt", ".csv", ".asc", ".pts", ".npy", ".npz",
    ".off", ".obj", ".stl", ".glb",
)  # fmt: skip
BUNDLED = (REFERENCE, *TARGETS)
_LONGEST_NAME = 60


def read_upload(name: str, content: bytes, category: str, unit: str | None = None) -> PointCloud:
    """The cloud, in metres, of a file that a browser sent.

    unit: where the file does not say it. Raises what `read_sent` raises, and ProcessError where
    nothing tells the unit.
    """
    cloud = read_sent(name, content)
    return in_metres(cloud, known_unit(cloud, unit, category, shown_name(name), "the unit"))


def read_sent(name: str, content: bytes) -> PointCloud:
    """The cloud of a file that a browser sent, as it is.

    The name is for messages, and its ending for the format; it is not used as a path. Raises
    CloudError for a file that is too large, of another type, or that `nrdf.io.cloud.read_cloud`
    refuses.
    """
    ending = check_upload(name, len(content))
    shown = shown_name(name)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"upload{ending}"
        path.write_bytes(content)
        try:
            cloud = read_cloud(path)
            check_cloud(cloud, MINIMUM_POINTS)
        except NrdfError as error:
            raise type(error)(str(error).replace(str(path), shown)) from None
    return cloud


def check_upload(name: str, size: int) -> str:
    """The ending of a file's name. Raises CloudError for another type, or too many bytes."""
    shown = shown_name(name)
    ending = PurePath(shown).suffix.lower()
    if ending not in ENDINGS:
        raise CloudError(
            f"{shown} is no point cloud or mesh: the name must end with one of {', '.join(ENDINGS)}"
        )
    if size > LARGEST_UPLOAD:
        raise CloudError(too_large(shown, size))
    return ending


def too_large(shown: str, size: int) -> str:
    """The message for a file of that size, bytes, which is too large."""
    return (
        f"{shown} has {size / 2**20:.0f} MiB; at most {LARGEST_UPLOAD >> 20} MiB are taken: thin "
        "it out, or use the command line, which has no limit"
    )


def bundled(name: str) -> PointCloud:
    """A chair that comes with the package."""
    return bundled_chair(name)[0]


def thinned_reference(cloud: PointCloud) -> PointCloud:
    """A reference reduced to the working points that a model would take."""
    if len(cloud) <= WORKING_POINTS:
        return cloud
    return cloud.select(downsample(cloud.points, WORKING_POINTS, np.random.default_rng(0)))


def shown_name(name: str) -> str:
    """A file's name as it may be shown: the last part of a path, printable, not too long."""
    last = name.replace("\\", "/").rpartition("/")[2]
    printable = "".join(c for c in last if c.isprintable()).strip()
    if len(printable) > _LONGEST_NAME:
        ending = PurePath(printable).suffix[:8]
        printable = printable[: _LONGEST_NAME - len(ending) - 1] + "…" + ending
    return printable or "file"
