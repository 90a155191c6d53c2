"""What a person has made so far: kept in a folder after every change, with undo and redo.

A `Document` is never changed, only replaced, so that undoing is going back to an earlier one, and
work in the background can look at one while the next is made.
"""

from __future__ import annotations

import json
import logging
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field, ValidationError

from nrdf.cloud import PointCloud, check_cloud, read_cloud, write_cloud
from nrdf.errors import NrdfError, OutputError, ProcessError
from nrdf.locks import remove_parts
from nrdf.ply import write_atomically
from nrdf.regions.model import MINIMUM_POINTS
from nrdf.strict import Strict, explain

log = logging.getLogger(__name__)

FILE = "session.json"
CLOUDS = "clouds"
VERSION = 1
_LARGEST_FILE = 1 << 28
_MOST_UNDONE = 200
_CLOUD_FILE = re.compile(r"cloud-\d+\.ply")


@dataclass(frozen=True)
class Painted:
    """A region of the reference: mask (n,) bool; colour: red, green, blue, 0 to 255; steps: what is
    done to it, each as the mapping that a knowledge file holds, SI (it need not be right yet)."""

    name: str
    colour: tuple[int, int, int]
    mask: np.ndarray
    steps: tuple[Mapping[str, Any], ...] = ()


@dataclass(frozen=True)
class Loaded:
    """An object: what people call it, its cloud in metres, and its file in the session's folder."""

    name: str
    cloud: PointCloud
    file: str = ""


@dataclass(frozen=True)
class Target:
    """An object that the process is brought to. corrected: regions painted by hand on it, name to
    mask (m,) bool, in place of those that are found."""

    object: Loaded
    corrected: Mapping[str, np.ndarray] = field(default_factory=dict)


@dataclass(frozen=True)
class Document:
    """Everything of a session that a person has made."""

    category: str = "chair"
    reference: Loaded | None = None
    regions: tuple[Painted, ...] = ()
    targets: tuple[Target, ...] = ()
    allow_overlap: bool = False

    def region(self, name: str) -> Painted | None:
        """The region of that name, or None."""
        return next((r for r in self.regions if r.name == name), None)

    def with_region(self, name: str, called: str = "", **changes: Any) -> Document:
        """The document with something of a region changed; `called`: its new name."""
        changes |= {"name": called or name}
        regions = tuple(replace(r, **changes) if r.name == name else r for r in self.regions)
        return replace(self, regions=regions)

    def with_target(self, name: str, **changes: Any) -> Document:
        """The document with something of a target changed."""
        targets = tuple(replace(t, **changes) if t.object.name == name else t for t in self.targets)
        return replace(self, targets=targets)


class Session:
    """A document in a folder, with its history. Every change is on disk when `change` returns.

    Raises OutputError where the folder cannot be written, ProcessError for a session file that is
    damaged, or from a newer version.
    """

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)
        self._undone: list[Document] = []
        self._done: list[Document] = []
        try:
            (self.folder / CLOUDS).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError(
                f"cannot make the session's folder {self.folder}: {error.strerror or error}; give "
                "another one with --session"
            ) from None
        self.restored = (self.folder / FILE).exists()
        self.document = _read(self.folder) if self.restored else Document()
        self._tidy()

    def change(self, document: Document, merge: bool = False) -> None:
        """Replace the document, and save it. `merge`: as a part of the last change, undone with it.

        Raises OutputError where it cannot be saved; the change is made all the same.
        """
        if not merge or not self._done:
            self._done = [*self._done[-_MOST_UNDONE:], self.document]
        self._undone.clear()
        self.document = document
        self.save()

    def undo(self) -> bool:
        """Go back by one change; whether there was one."""
        return self._go(self._done, self._undone)

    def redo(self) -> bool:
        """Take the last undoing back; whether there was one."""
        return self._go(self._undone, self._done)

    def store(self, name: str, cloud: PointCloud) -> Loaded:
        """Write a cloud, in metres, into the session's folder, to be put into a document."""
        taken = [int(p.stem.split("-")[1]) for p in (self.folder / CLOUDS).glob("cloud-*.ply")]
        file = f"cloud-{max(taken, default=0) + 1}.ply"
        write_cloud(self.folder / CLOUDS / file, cloud)
        return Loaded(name, cloud, file)

    def save(self) -> None:
        """Write the document, all of it or nothing."""
        text = json.dumps(_plain(self.document), ensure_ascii=False, separators=(",", ":"))
        write_atomically(self.folder / FILE, [text.encode()])

    def path_of(self, loaded: Loaded) -> Path:
        """The file of an object's cloud."""
        return self.folder / CLOUDS / loaded.file

    def _tidy(self) -> None:
        """Remove clouds that only changes undone in an earlier run had."""
        document = self.document
        objects = [target.object for target in document.targets]
        objects += [] if document.reference is None else [document.reference]
        for path in (self.folder / CLOUDS).glob("cloud-*.ply"):
            if path.name not in {loaded.file for loaded in objects}:
                path.unlink(missing_ok=True)
        remove_parts(self.folder / CLOUDS)

    def _go(self, taken: list[Document], kept: list[Document]) -> bool:
        if not taken:
            return False
        kept.append(self.document)
        self.document = taken.pop()
        self.save()
        return True


def _plain(document: Document) -> dict[str, Any]:
    """A document as its file holds it; regions as indices."""

    def loaded(of: Loaded) -> dict[str, str]:
        return {"name": of.name, "file": of.file}

    return {
        "version": VERSION,
        "category": document.category,
        "allow_overlap": document.allow_overlap,
        "reference": None if document.reference is None else loaded(document.reference),
        "regions": [
            {
                "name": region.name,
                "colour": region.colour,
                "indices": np.flatnonzero(region.mask).tolist(),
                "steps": list(region.steps),
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


class _Object(Strict):
    name: str
    file: str = Field(pattern=f"^{_CLOUD_FILE.pattern}$")


class _Region(Strict):
    name: str
    colour: tuple[int, int, int]
    indices: list[int]
    steps: list[dict[str, Any]]


class _Target(_Object):
    corrected: dict[str, list[int]] = Field(default_factory=dict)


class _Content(Strict):
    version: int
    category: str
    allow_overlap: bool
    reference: _Object | None
    regions: list[_Region]
    targets: list[_Target]


def _read(folder: Path) -> Document:
    path = folder / FILE
    advice = "move it away to begin anew, or give another folder with --session"
    try:
        if path.stat().st_size > _LARGEST_FILE:
            raise ProcessError(f"{path} is larger than {_LARGEST_FILE >> 20} MiB; {advice}")
        content = _Content.model_validate_json(path.read_bytes())
    except OSError as error:
        raise ProcessError(f"cannot read {path}: {error.strerror or error}; {advice}") from None
    except ValidationError as error:
        faults = explain(error, _Content, lambda place: ".".join(map(str, place)))
        raise ProcessError(f"{path} is damaged: {faults[0]}; {advice}") from None
    if content.version > VERSION:
        raise ProcessError(f"{path} is from a newer nrdf: update nrdf, or {advice}")
    if content.reference is None:
        return Document(content.category)
    try:
        reference = _read_object(folder, content.reference)
        regions = tuple(
            Painted(r.name, r.colour, _mask(r.indices, reference, r.name), tuple(r.steps))
            for r in content.regions
        )
        targets = tuple(_read_target(folder, target) for target in content.targets)
    except NrdfError as error:
        raise ProcessError(f"{path} is damaged: {error}; {advice}") from None
    return Document(content.category, reference, regions, targets, content.allow_overlap)


def _read_object(folder: Path, content: _Object) -> Loaded:
    cloud = read_cloud(folder / CLOUDS / content.file)
    check_cloud(cloud, MINIMUM_POINTS)
    return Loaded(content.name, cloud, content.file)


def _read_target(folder: Path, content: _Target) -> Target:
    loaded = _read_object(folder, content)
    corrected = {n: _mask(i, loaded, n) for n, i in content.corrected.items()}
    return Target(loaded, corrected)


def _mask(indices: list[int], loaded: Loaded, name: str) -> np.ndarray:
    mask = np.zeros(len(loaded.cloud), bool)
    if indices and not 0 <= min(indices) <= max(indices) < len(mask):
        raise ProcessError(f"region '{name}' has points that {loaded.name} does not have")
    mask[indices] = True
    return mask
