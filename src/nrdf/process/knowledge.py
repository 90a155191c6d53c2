"""Process knowledge: on which regions of a reference object what is done, and how (paper, eq. 10).

The models here and in `nrdf.process.process` are the knowledge file's format;
`nrdf.process.knowledge_file` reads and writes it. Every quantity is SI and its name ends with its
unit; a file may give millimetres, degrees and revolutions per minute instead (``stepover_mm``,
``tilt_deg``, ``feed_mm_s``, ``spindle_rpm``). Positions and directions are in the frame of the
reference cloud.
"""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal

from pydantic import AfterValidator, Field, model_validator

from nrdf.io.file_names import clashing_names
from nrdf.process.process import Process
from nrdf.process.quantities import FileName, Name, Quantities, Vector
from nrdf.regions.region import region_name_fault

VERSION: Final = 1
_LONGEST_LABEL = 190  # characters of a name to which a number is added


def _region_name(text: str) -> str:
    if fault := region_name_fault(text):
        raise ValueError(f"no name for a region: {fault}")
    return text


Index = Annotated[int, Field(ge=0, lt=2**31)]


class Region(Quantities):
    """A region of the reference, given in one of four ways, and what is done to it."""

    name: Annotated[Name, Field(max_length=100), AfterValidator(_region_name)]
    """Its name."""
    file: FileName | None = None
    """Cloud of points that lie on the reference, or .npy, .npz of a mask, indices or points; from
    the knowledge file's folder; an .npz of several regions has this one under its name."""
    mask: Annotated[list[bool], Field(fail_fast=True)] | None = None
    """For each point of the reference whether it belongs to the region."""
    indices: Annotated[list[Index], Field(fail_fast=True)] | None = None
    """Which points of the reference belong to it, counted from 0."""
    points_m: Annotated[list[Vector], Field(fail_fast=True)] | None = None
    """Points that lie on the reference, in its frame."""
    fill_holes: bool = False
    """Whether holes of the region on a new object are worked as well, however large; unless given,
    only those smaller than the tool's footprint."""
    processes: list[Process] = Field(min_length=1, max_length=100)
    """What is done to it, one after another."""

    @property
    def steps(self) -> list[Process]:
        """The processes, each with a label of its own: where several have the same one, all but the
        first are named after it with a number, "sand 2"."""
        taken = {process.label for process in self.processes}
        seen: set[str] = set()
        made = []
        for process in self.processes:
            label = process.label
            if label in seen:
                names = (f"{process.label[:_LONGEST_LABEL]} {k}" for k in range(2, len(taken) + 3))
                label = next(name for name in names if name not in taken)
                process = process.model_copy(update={"name": label})
            seen.add(label)
            taken.add(label)
            made.append(process)
        return made

    @model_validator(mode="after")
    def _given_once(self) -> Region:
        ways = ("file", "mask", "indices", "points_m")
        given = [way for way in ways if getattr(self, way) is not None]
        if len(given) != 1:
            raise ValueError(
                f"give exactly one of {', '.join(ways)}; given: {', '.join(given) or 'none'}"
            )
        return self


class Reference(Quantities):
    """The object that the process was taught on: a file, or its points."""

    cloud: FileName | None = None
    """Cloud or mesh; from the knowledge file's folder."""
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")] | None = None
    """Checksum of that file: regions are only right on the cloud that they were taught on."""
    unit: Literal["m", "cm", "mm", "in"] | None = None
    """Unit of the cloud's file, where it does not say."""
    frame: Name | None = None
    """Name of the cloud's coordinate frame, where its file does not say."""
    points_m: Annotated[list[Vector], Field(fail_fast=True)] | None = None
    """Instead of a file: the points themselves."""
    normals: Annotated[list[Vector], Field(fail_fast=True)] | None = None
    """Outward unit normals of these points."""

    @model_validator(mode="after")
    def _given_once(self) -> Reference:
        if (self.cloud is None) == (self.points_m is None):
            raise ValueError("give either cloud (a file) or points_m")
        if self.points_m is not None and (self.sha256 or self.unit not in (None, "m")):
            raise ValueError("sha256 and unit belong to a cloud's file; points_m is in metres")
        if self.normals is not None and len(self.normals) != len(self.points_m or ()):
            raise ValueError("normals need points_m, one each")
        return self


class Knowledge(Quantities):
    """What was taught on one object, for other objects of its category."""

    version: Literal[1] = VERSION
    """Version of this format."""
    category: Name
    """What the object is, in your own words; chair, car and plane have a trained model."""
    model: Name | None = None
    """Model that finds the regions: a name in the zoo, or one that serves any category (general,
    registration); the category's own unless given, and general where it has none."""
    reference: Reference
    """The object that it was taught on."""
    allow_unusual: bool = False
    """Whether a category that is nearly called like a known one is meant; a process says so of its
    values."""
    allow_overlap: bool = False
    """Whether regions may have points in common."""
    regions: list[Region] = Field(min_length=1, max_length=500)
    """The process regions of interest (P-ROIs)."""
    origin: dict[str, Any] = Field(default={})
    """Where it comes from; written by transfer."""

    @model_validator(mode="after")
    def _distinct_names(self) -> Knowledge:
        names = [region.name for region in self.regions]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise ValueError(f"two regions are called '{twice}'; rename one")
        if twins := clashing_names(names):
            raise ValueError(
                f"the regions '{twins[0]}' and '{twins[1]}' would be one file on Windows and "
                "macOS; rename one"
            )
        return self
