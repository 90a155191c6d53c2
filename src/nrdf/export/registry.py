"""The formats of tool paths, each a module with a function `write(job, options, folder)`."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from nrdf.errors import OutputError, ProcessError, unknown_name
from nrdf.export.options import Options

if TYPE_CHECKING:
    from nrdf.toolpath.types import Job

FORMATS = {
    "ros2-bag": "nrdf.export.ros2_bag",
    "noether": "nrdf.export.noether",
    "apt": "nrdf.export.apt",
    "gcode": "nrdf.export.gcode",
    "urscript": "nrdf.export.urscript",
    "rapid": "nrdf.export.rapid",
    "krl": "nrdf.export.krl",
    "csv": "nrdf.export.csv_file",
    "json": "nrdf.export.json_file",
}
"""Format to module; a module is imported when it is used."""


def check_formats(formats: Sequence[str]) -> None:
    """Raise ProcessError for no format, or for one that is not known, listing those that are."""
    if not formats:
        raise ProcessError(f"no format given; known: {', '.join(FORMATS)}")
    for name in formats:
        if name not in FORMATS:
            raise ProcessError(unknown_name("export format", name, tuple(FORMATS)))


def export_job(
    job: Job, formats: Sequence[str], folder: Path, options: Options | None = None
) -> dict[str, list[str]]:
    """Write `job` in each of `formats` into a folder of the format's name in `folder`.

    Gives the files of each format, relative to `folder`. Raises ProcessError for a format that is
    not known, a job without tool paths, a name that a controller cannot take, or a missing
    package, and OutputError where `folder` cannot be written.
    """
    check_formats(formats)
    files = {}
    for name in dict.fromkeys(formats):
        place = folder / name
        try:
            place.mkdir(parents=True)
        except OSError as error:
            raise OutputError(f"cannot make the folder {place}: {error.strerror}") from None
        import_module(FORMATS[name]).write(job, options or Options(), place)
        written = (path for path in place.rglob("*") if path.is_file())
        files[name] = sorted(path.relative_to(folder).as_posix() for path in written)
    return files
