"""Files that a browser sends, and objects that come with the package, as clouds in metres."""

from __future__ import annotations

import io
import tempfile
import zipfile
import zlib
from pathlib import Path, PurePath

import numpy as np

from nrdf.bundled import REFERENCE, TARGETS, bundled_chair
from nrdf.errors import CloudError, NrdfError, ProcessError
from nrdf.field.cloud_encoder import MINIMUM_POINTS, WORKING_POINTS
from nrdf.geometry.sampling import downsample
from nrdf.io.atomic import output_errors
from nrdf.io.cloud import PointCloud, check_cloud, in_metres, read_cloud
from nrdf.io.file_names import safe_file_name
from nrdf.process.bound_knowledge import BoundKnowledge, known_unit, read_bound_knowledge

LARGEST_UPLOAD = 128 << 20
ENDINGS = (
    ".ply", ".pcd", ".xyz", ".xyzn", ".txt", ".csv", ".asc", ".pts", ".npy", ".npz",
    ".off", ".obj", ".stl", ".glb",
)  # fmt: skip
BUNDLED = (REFERENCE, *TARGETS)
_LONGEST_NAME = 60
_MOST_FILES, _DEEPEST = 600, 8
YAML = (".yaml", ".yml")


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
    refuses, and OutputError where the disk is full.
    """
    ending = check_upload(name, len(content))
    shown = shown_name(name)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"upload{ending}"
        with output_errors(path):
            path.write_bytes(content)
        try:
            cloud = read_cloud(path)
            check_cloud(cloud, MINIMUM_POINTS)
        except NrdfError as error:
            raise type(error)(str(error).replace(str(path), shown)) from None
    return cloud


def read_knowledge_zip(name: str, content: bytes) -> BoundKnowledge:
    """The knowledge of a ZIP archive that a browser sent: one knowledge file, and what it names.

    Raises ProcessError for what is no such archive, holds folders within folders or too much,
    OutputError where the disk is full, and what
    `nrdf.process.bound_knowledge.read_bound_knowledge` raises.
    """
    with tempfile.TemporaryDirectory() as kept:
        folder, shown = Path(kept), shown_name(name)
        unpack(name, content, folder, "give knowledge.zip of step 5, or one made of a knowledge "
               "file and the files that it names", flat=True)  # fmt: skip
        found = [path for path in folder.iterdir() if path.suffix in YAML]
        if len(found) != 1:
            raise ProcessError(f"{shown} holds {len(found)} knowledge files (.yaml); give one")
        try:
            return read_bound_knowledge(found[0])
        except NrdfError as error:
            raise type(error)(str(error).replace(f"{folder}/", "")) from None


def unpack(name: str, content: bytes, folder: Path, wanted: str, flat: bool) -> None:
    """Write the files of a ZIP archive that a browser sent into a folder; flat: by the last parts
    of their names alone, else in the archive's folders, which stay inside.

    Raises ProcessError, which says what is `wanted`, for what is no such archive, holds too much
    or names that are not taken, and OutputError where the disk is full.
    """
    shown = shown_name(name)
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            _unpack(archive, folder, shown, flat)
    except (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, OSError):
        raise ProcessError(f"{shown} is no ZIP archive that can be read; {wanted}") from None


def _unpack(archive: zipfile.ZipFile, folder: Path, shown: str, flat: bool) -> None:
    members = [m for m in archive.infolist() if not (m.is_dir() or _of_macos(m.filename))]
    if len(members) > _MOST_FILES or sum(m.file_size for m in members) > LARGEST_UPLOAD:
        raise ProcessError(
            f"{shown} holds {len(members)} files; at most {_MOST_FILES} of together "
            f"{LARGEST_UPLOAD >> 20} MiB are taken"
        )
    for member in members:
        parts = PurePath(member.filename.replace("\\", "/")).parts
        parts = parts[-1:] if flat else parts
        path = folder.joinpath(*parts)
        safe = 0 < len(parts) <= _DEEPEST and all(safe_file_name(p, "") == p for p in parts)
        if not safe or path.exists():
            named = shown_name(member.filename)
            raise ProcessError(f"{shown}: '{named}' is no name that is taken, or twice")
        with archive.open(member) as sent:  # no more than its size says
            whole = sent.read(member.file_size)
        with output_errors(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(whole)


def _of_macos(name: str) -> bool:
    """Whether a file is one that macOS adds to archives."""
    return name.startswith("__MACOSX/") or PurePath(name).name == ".DS_Store"


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
