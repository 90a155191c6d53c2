"""Meshes whose faces carry the names of their parts, from any folder of the form below.

    labels.json               {"labels": {"seat": 1, "leg": 3, "mixed": 9}}
    index.csv                 a line an object: category, name (and perhaps forward_sure)
    <category>/<name>.npz     vertices (v, 3), faces (f, 3), face_label_fine or face_label (f,)

Files are data of strangers: nothing in them is run, and what they claim is checked before room is
made for it. docs/evidence/objects.md says more.
"""

from __future__ import annotations

import csv
import hashlib
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from nrdf.errors import DataError, unknown_name
from nrdf.geometry.canonical import canonical_transform
from nrdf.geometry.mesh import MAX_FACES, check_mesh, clean_faces
from nrdf.io.files import read_file
from nrdf.io.formats.arrays import Arrays, open_arrays
from nrdf.io.yaml_json import read_json

LABELS, INDEX = "labels.json", "index.csv"
IGNORED, BACKGROUND = ("mixed",), ("other",)
"""Labels that count nowhere, and labels that are no part; unless `labels.json` names others."""
_MOST_LABELS = 1000
_MOST_TEXT = 10_000_000  # bytes of labels.json and index.csv
_WORD = re.compile(r"\w[\w.-]{0,99}")


@dataclass(frozen=True)
class Labels:
    """Names of the parts. names: label number to name; ignored: names that count nowhere, because
    they are of several parts at once; background: names of what is no part."""

    names: dict[int, str]
    ignored: tuple[str, ...] = IGNORED
    background: tuple[str, ...] = BACKGROUND

    @property
    def parts(self) -> tuple[str, ...]:
        """The names that can be regions, in the order of their numbers."""
        left_out = {*self.ignored, *self.background}
        return tuple(self.names[i] for i in sorted(self.names) if self.names[i] not in left_out)


@dataclass(frozen=True)
class ObjectEntry:
    """A line of `index.csv`. forward_sure: whether it is known which side is the front: "no" in the
    column of that name says that it is not."""

    category: str
    name: str
    forward_sure: bool = True

    @property
    def key(self) -> str:
        """What tells an object from all others of its folder: "chair/agam"."""
        return f"{self.category}/{self.name}"


@dataclass(frozen=True)
class LabelledMesh:
    """An object: vertices (v, 3), canonical; faces (f, 3), cleaned by
    `nrdf.geometry.mesh.clean_mesh`; label (f,) name of each face's part; checksum: SHA-256 of its
    file."""

    entry: ObjectEntry
    vertices: np.ndarray
    faces: np.ndarray
    label: np.ndarray
    checksum: str

    @property
    def key(self) -> str:
        """As `ObjectEntry.key`."""
        return self.entry.key


def read_labels(folder: Path) -> Labels:
    """The names of the labels, from `labels.json`.

    Raises DataError if the file is missing or does not say {"labels": {name: number}}.
    """
    path = folder / LABELS
    try:
        content = read_json(_read_text(path))
        names = {int(number): str(name) for name, number in content["labels"].items()}
        ignored, background = (
            tuple(map(str, content.get(key, usual)))
            for key, usual in (("ignored", IGNORED), ("background", BACKGROUND))
        )
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise DataError(
            f'{path}: expected {{"labels": {{"seat": 1, "leg": 2}}}}, and perhaps "ignored" and '
            f'"background", lists of such names ({error})'
        ) from None
    if not 0 < len(names) <= _MOST_LABELS or len(names) < len(content["labels"]):
        raise DataError(
            f"{path}: {len(content['labels'])} labels of {len(names)} numbers; give 1 to "
            f"{_MOST_LABELS}, each a number of its own"
        )
    return Labels(names, ignored, background)


def list_objects(folder: Path) -> list[ObjectEntry]:
    """The objects that `index.csv` lists.

    Raises DataError if the file is missing, lacks a column, names an object twice or none, or a
    name is no plain word.
    """
    path = folder / INDEX
    try:
        rows = list(csv.DictReader(_read_text(path).splitlines()))
    except csv.Error as error:
        raise DataError(f"{path}: no table with commas ({error})") from None
    found: dict[str, ObjectEntry] = {}
    for row in rows:
        category, name = row.get("category") or "", row.get("name") or ""
        if not (_WORD.fullmatch(category) and _WORD.fullmatch(name)):
            raise DataError(
                f"{path}: '{category}', '{name}' is no category and name; the columns category and "
                "name must hold plain words: letters, digits, '_', '-' and '.'"
            )
        item = ObjectEntry(category, name, (row.get("forward_sure") or "").strip() != "no")
        if item.key in found:
            raise DataError(f"{path}: lists {category}, {name} twice")
        found[item.key] = item
    if not found:
        raise DataError(f"{path}: lists no object; expected the columns category and name")
    return list(found.values())


def read_object(folder: Path, entry: ObjectEntry, labels: Labels) -> LabelledMesh:
    """One object, canonical: its centre at 0, its longest side 1.

    Raises DataError if its file is missing, damaged, too large, or a face's label has no name.
    """
    path = folder / entry.category / f"{entry.name}.npz"
    if not path.is_file():
        raise DataError(f"{folder}: {INDEX} lists {entry.key}, but there is no {path}")
    with open_arrays(path, DataError) as arrays:
        fine = "face_label_fine" in arrays.names
        vertices = _load(arrays, "vertices", 3, "f")
        faces = _load(arrays, "faces", 3, "iu")
        number = _load(arrays, "face_label_fine" if fine else "face_label", 1, "iu")
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    if len(number) != len(faces):
        raise DataError(f"{path}: {len(number)} labels for {len(faces)} faces; one each is needed")
    unknown = sorted({*number.tolist()} - {*labels.names})
    if unknown:
        raise DataError(
            f"{path}: label {unknown[0]} has no name; {LABELS} knows "
            f"{', '.join(f'{i} {labels.names[i]}' for i in sorted(labels.names))}"
        )
    try:
        vertices, faces, kept = clean_faces(*check_mesh(vertices, faces))
    except DataError as error:
        raise DataError(f"{path}: {error}") from None
    centre, scale = canonical_transform(vertices)
    names = np.array([labels.names[i] for i in number[kept].tolist()])
    return LabelledMesh(entry, (vertices - centre) / scale, faces, names, digest)


def read_objects(folder: Path, categories: Sequence[str] = ()) -> list[LabelledMesh]:
    """All objects of some categories (all, unless given), in the order of `index.csv`.

    Raises DataError as the readers above do, and for a category of which there is none.
    """
    labels, entry = read_labels(folder), list_objects(folder)
    known = list(dict.fromkeys(item.category for item in entry))
    for category in categories:
        if category not in known:
            raise DataError(f"{folder}: {unknown_name('category', category, known)}")
    chosen = [item for item in entry if item.category in categories or not categories]
    return [read_object(folder, item, labels) for item in chosen]


def _read_text(path: Path) -> str:
    try:
        return read_file(path, DataError, _MOST_TEXT).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise DataError(f"{path}: no UTF-8 text ({error})") from None
    except DataError as error:
        raise DataError(
            f"{error}; a folder of labelled objects has {LABELS}, {INDEX} and "
            "<category>/<name>.npz (docs/evidence/objects.md)"
        ) from None


def _load(arrays: Arrays, name: str, columns: int, kinds: str) -> np.ndarray:
    """An array (n,) or (n, columns), whose head was looked at before. Raises ValueError."""
    if name not in arrays.names:
        raise ValueError(f"it has no array '{name}', only: {', '.join(arrays.names)}")
    shape, kind = arrays.head(name)
    wanted = shape[:1] if columns == 1 else (*shape[:1], columns)
    if not shape or shape != wanted or kind.kind not in kinds or shape[0] > MAX_FACES:
        raise ValueError(
            f"'{name}' is {shape} of {kind}; expected at most {MAX_FACES} rows of {columns}"
        )
    return arrays.load(name)
