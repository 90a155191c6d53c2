"""The file of a session and the clouds beside it: written whole, and checked when read.

It may have been edited, cut off, or written by somebody else.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    field_validator,
    model_validator,
)

from nrdf.errors import NrdfError, OutputError, ProcessError
from nrdf.field.cloud_encoder import MINIMUM_POINTS
from nrdf.io.atomic import write_atomically
from nrdf.io.cloud import check_cloud, read_cloud
from nrdf.io.files import read_file
from nrdf.io.schema import StrictModel, validation_messages
from nrdf.process.new_knowledge import KINDS
from nrdf.regions.region import region_name_fault
from nrdf.studio.model.document import REFERENCE, Document, LoadedObject, PaintedRegion, Target
from nrdf.studio.model.placement_file import PlacementContent

FILE = "session.json"
CLOUDS = "clouds"
VERSION = 2
DAMAGED = "damaged"
_LARGEST_FILE = 1 << 28
_CLOUD_FILE = r"cloud-\d{1,9}\.ply"


class NewerSession(ProcessError):
    """A session that a newer version of nrdf has written."""


def _folder_name(name: str) -> str:
    if set(name) <= {".", " "} or not name.isprintable() or set(name) & set("/\\"):
        raise ValueError("must be printable, without slashes, and more than dots")
    return name


def _region_name(name: str) -> str:
    if fault := region_name_fault(name):
        raise ValueError(fault)
    return name


_Name = Annotated[str, Field(max_length=200), AfterValidator(_folder_name)]
"""Of an object; a target's is the name of a folder, too."""
_Shade = Annotated[int, Field(ge=0, le=255)]
_Number = Annotated[float, Field(ge=-1e9, le=1e9)]


class _Shown(BaseModel):
    """The part of something unfinished that the page shows; the rest is kept as it is."""

    model_config = ConfigDict(extra="allow", frozen=True, allow_inf_nan=False)


class _Tool(_Shown):
    name: str = "tool"
    radius_m: _Number = 0.0
    clearance_m: _Number = 0.0
    body_length_m: _Number | None = None
    body_radius_m: _Number | None = None


class _Step(_Shown):
    kind: str
    tool: _Tool
    name: str | None = None
    trajectory: str = "raster"
    direction: tuple[_Number, _Number, _Number] | None = None
    passes: Annotated[int, Field(ge=-(10**9), le=10**9)] = 1
    stepover_m: _Number | None = None
    spacing_m: _Number = 0.0
    edge_margin_m: _Number = 0.0
    force_n: _Number | None = None
    force_tolerance_n: _Number | None = None
    feed_m_s: _Number = 0.0
    lead_rad: _Number = 0.0
    tilt_rad: _Number = 0.0
    standoff_m: _Number = 0.0
    spindle_rad_s: _Number | None = None

    @field_validator("kind")
    @classmethod
    def _known(cls, kind: str) -> str:
        if kind not in KINDS:
            raise ValueError(f"must be one of {', '.join(KINDS)}")
        return kind


class _Object(StrictModel):
    name: _Name
    file: str = Field(pattern=f"^{_CLOUD_FILE}$")
    placement: PlacementContent | None = None
    scan: _Object | None = None


class _Region(StrictModel):
    name: Annotated[str, AfterValidator(_region_name)]
    colour: tuple[_Shade, _Shade, _Shade]
    indices: list[int]
    steps: list[_Step] = Field(min_length=1)
    fill_holes: bool = False


class _Target(_Object):
    corrected: dict[str, list[int]] = Field(default_factory=dict)


class _Content(StrictModel):
    version: int = Field(ge=1)
    category: str = Field(min_length=1, max_length=100)
    model: str | None = Field(default=None, min_length=1, max_length=100)
    allow_overlap: bool
    allow_unusual: bool = False
    origin: dict[str, Any] = Field(default={})
    reference: _Object | None
    regions: list[_Region]
    targets: list[_Target]

    @model_validator(mode="after")
    def _names_differ(self) -> _Content:
        for what in (self.regions, self.targets):
            names = [item.name for item in what]
            if len(set(names)) < len(names):
                raise ValueError(f"names are there twice: {', '.join(sorted(names))[:200]}")
        if any(target.name == REFERENCE for target in self.targets):
            raise ValueError(f"'{REFERENCE}' is no name for a target")
        return self


def write_document(folder: Path, document: Document) -> None:
    """Write a session's file, all of it or nothing."""
    text = json.dumps(_plain(document), ensure_ascii=False, separators=(",", ":"))
    write_atomically(folder / FILE, [text.encode()])


def read_document(folder: Path) -> Document:
    """The document of a session's folder.

    Raises NewerSession for one that a newer nrdf has written, OutputError where its file cannot be
    read, and ProcessError for one that is damaged, saying how.
    """
    path = folder / FILE
    try:
        text = read_file(path, OutputError, _LARGEST_FILE)
    except OutputError as error:
        raise OutputError(f"{error}; give another folder with --session") from None
    try:
        content = _Content.model_validate_json(text)
    except ValidationError as error:
        if _version(text) > VERSION:
            raise _newer(path) from None
        faults = validation_messages(error, _Content, lambda place: ".".join(map(str, place)), 1)
        raise ProcessError(f"{path} is damaged: {faults[0]}") from None
    if content.version > VERSION:
        raise _newer(path)
    if content.reference is None:
        return Document(content.category, model=content.model)
    try:
        reference = _read_object(folder, content.reference)
        regions = tuple(
            PaintedRegion(
                r.name, r.colour, _mask(r.indices, reference, r.name), _steps(r), r.fill_holes
            )
            for r in content.regions
        )
        targets = tuple(_read_target(folder, target) for target in content.targets)
    except NrdfError as error:
        raise ProcessError(f"{path} is damaged: {error}") from None
    return Document(
        content.category, reference, regions, targets, content.allow_overlap, content.model,
        content.allow_unusual, content.origin,
    )  # fmt: skip


def put_aside(folder: Path) -> Path:
    """Move a session's file and its clouds into a folder of their own, and make room for new ones.

    Moved back as they are, they are that session again. Raises OutputError where that fails.
    """
    number = 1
    while (aside := folder / f"{DAMAGED}-{number}").exists():
        number += 1
    try:
        aside.mkdir()
        # The file last: without it, its clouds would be taken for ones that nothing needs.
        os.replace(folder / CLOUDS, aside / CLOUDS)
        os.replace(folder / FILE, aside / FILE)
        (folder / CLOUDS).mkdir()
    except OSError as error:
        raise OutputError(
            f"cannot move the damaged session in {folder} to {aside}: {error.strerror or error}; "
            "give another folder with --session"
        ) from None
    return aside


def _newer(path: Path) -> NewerSession:
    return NewerSession(
        f"{path} is from a newer nrdf: update nrdf, or give another folder with --session"
    )


def _version(text: bytes) -> int:
    """The version that a file says it has; 0 where it says none."""

    class Versioned(_Shown):
        version: int

    try:
        return Versioned.model_validate_json(text).version
    except ValidationError:
        return 0


def _steps(region: _Region) -> tuple[dict[str, Any], ...]:
    return tuple(step.model_dump(exclude_unset=True) for step in region.steps)


def _read_object(folder: Path, content: _Object) -> LoadedObject:
    cloud = read_cloud(folder / CLOUDS / content.file)
    check_cloud(cloud, MINIMUM_POINTS)
    placement = None if content.placement is None else content.placement.placement()
    scan = None if content.scan is None else _read_object(folder, content.scan)
    return LoadedObject(content.name, cloud, content.file, placement, scan)


def _read_target(folder: Path, content: _Target) -> Target:
    loaded = _read_object(folder, content)
    corrected = {n: _mask(i, loaded, n) for n, i in content.corrected.items()}
    return Target(loaded, corrected)


def _mask(indices: list[int], loaded: LoadedObject, name: str) -> np.ndarray:
    mask = np.zeros(len(loaded.cloud), bool)
    if indices and not 0 <= min(indices) <= max(indices) < len(mask):
        raise ProcessError(f"region '{name}' has points that {loaded.name} does not have")
    mask[indices] = True
    return mask


def _plain(document: Document) -> dict[str, Any]:
    """A document as its file holds it; regions as indices."""

    def loaded(of: LoadedObject) -> dict[str, Any]:
        plain: dict[str, Any] = {"name": of.name, "file": of.file}
        if of.placement is not None:
            plain["placement"] = PlacementContent.of(of.placement).model_dump(mode="json")
        if of.scan is not None:
            plain["scan"] = loaded(of.scan)
        return plain

    return {
        "version": VERSION,
        "category": document.category,
        "model": document.model,
        "allow_overlap": document.allow_overlap,
        "allow_unusual": document.allow_unusual,
        "origin": dict(document.origin),
        "reference": None if document.reference is None else loaded(document.reference),
        "regions": [
            {
                "name": region.name,
                "colour": region.colour,
                "indices": np.flatnonzero(region.mask).tolist(),
                "steps": list(region.steps),
                "fill_holes": region.fill_holes,
            }
            for region in document.regions
        ],
        "targets": [
            {
                **loaded(target.object),
                "corrected": {n: np.flatnonzero(m).tolist() for n, m in target.corrected.items()},
            }
            for target in document.targets
        ],
    }
