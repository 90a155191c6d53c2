"""The weights that ship with the package, and the user's own: by name, verified by checksum.

A zoo is a folder of weight files (`nrdf.field.weights`) and an `index.json` that says of each one
its SHA-256, preset, category, scores, training shapes by source with licences, commit and date. One
ships with the package; the other is the user's (`user_zoo`), where `nrdf model learn` puts models.
Of two models of one name the user's is meant.
"""

from __future__ import annotations

import hashlib
import json
import logging
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from platformdirs import user_data_path
from pydantic import ConfigDict, TypeAdapter

from nrdf.errors import ModelError, OutputError
from nrdf.field.base import Field
from nrdf.field.registration import METADATA, REGISTRATION, RegistrationField
from nrdf.field.weights import load_weights, read_metadata
from nrdf.io.atomic import write_atomically
from nrdf.io.file_names import file_name_problem
from nrdf.io.files import read_file
from nrdf.io.schema import suggest_name

log = logging.getLogger(__name__)

ZOO = Path(__file__).resolve().parents[1] / "zoo"
INDEX = "index.json"
_LARGEST_INDEX = 10_000_000  # bytes
LARGEST = 8_000_000
"""Bytes that a weight file in the zoo may have."""
KIND = "kind"
"""Preset of what tells the kind of object (`nrdf.field.kind_network`): no field, so it has a folder
of its own."""
WEIGHTS = "weights.safetensors"
"""What a finished training run calls its weight file."""


@dataclass(frozen=True)
class ZooEntry:
    """One model of the zoo. scores: name to value, lower is better; shapes: source to count and
    licences of the training shapes."""

    __pydantic_config__ = ConfigDict(extra="forbid")

    name: str
    file: str
    sha256: str
    bytes: int
    category: str
    preset: str
    scores: dict[str, float] = field(default_factory=dict)
    shapes: dict[str, Any] = field(default_factory=dict)
    commit: str | None = None
    date: str | None = None
    note: str = ""


_ENTRY = TypeAdapter(ZooEntry)


def user_zoo() -> Path:
    """The folder of the user's own models, where the system keeps such data; it may not exist."""
    return user_data_path("nrdf", appauthor=False) / "zoo"


def list_models(zoo: Path | None = None) -> list[ZooEntry]:
    """The models of a zoo by name, of the user's and the package's unless given; none if there is
    no index.

    Raises ModelError if an index is damaged.
    """
    return [entry for _, entry in _find_models(zoo)]


def _find_models(zoo: Path | None) -> list[tuple[Path, ZooEntry]]:
    """Each model with the zoo that holds it, by name; of two of one name the user's."""
    found = {entry.name: (place, entry) for place in _zoos(zoo) for entry in _read_index(place)}
    return [found[name] for name in sorted(found)]


def _zoos(zoo: Path | None) -> list[Path]:
    return [ZOO, user_zoo()] if zoo is None else [zoo]


def _read_index(zoo: Path) -> list[ZooEntry]:
    path = zoo / INDEX
    if not path.exists():
        return []
    try:
        models = json.loads(read_file(path, ModelError, _LARGEST_INDEX))["models"]
        entries = [_ENTRY.validate_python({**models[n], "name": n}) for n in sorted(models)]
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise ModelError(f"{path} is damaged ({error}); {_mend(zoo)}") from None
    for entry in entries:
        if Path(entry.file).name != entry.file:
            raise ModelError(f"{path} is damaged ('{entry.file}' is no file of it)")
    return entries


def find_weights(name: str | Path, zoo: Path | None = None) -> Path:
    """The weight file of a zoo name, of a path to one, or of a finished training run's folder.

    zoo: the one to look in; the user's and the package's unless given. Raises ModelError for an
    unknown name (listing the known ones), a run that has not finished, a file that is missing, and
    a file of the zoo that differs from its checksum.
    """
    models = {entry.name: (place, entry) for place, entry in _find_models(zoo)}
    if str(name) in models:
        return _verified(*models[str(name)])
    path = Path(name)
    if path.is_dir():
        if not (path / WEIGHTS).is_file():
            raise ModelError(
                f"the folder {path} holds no {WEIGHTS}: its training run has not finished (start "
                "the same `nrdf model train` again to go on), or it is no training run"
            )
        return path / WEIGHTS
    if path.is_file():
        return path
    if str(name) == REGISTRATION:
        raise ModelError(f"the model {REGISTRATION} has no weights; name a trained one here")
    hint = suggest_name(str(name), [*models, REGISTRATION])
    raise ModelError(
        f"no model '{name}'{hint}; {REGISTRATION} serves any category; or give the path of a "
        "weight file (.safetensors) or of a finished training run's folder"
    )


def load_field(name: str | Path, zoo: Path | None = None) -> tuple[Field, dict[str, Any]]:
    """The field of a zoo name or path, or the model `registration`, on the CPU in evaluation mode,
    and its metadata.

    The metadata are the weight file's, with `name` and `file` added; `scores` of the zoo's index
    come before those of the file. Raises ModelError (`find_weights`, `load_weights`).
    """
    if name == REGISTRATION:
        return RegistrationField(), dict(METADATA)
    path = find_weights(name, zoo)
    loaded, metadata = load_weights(path)
    for place, entry in _find_models(zoo):
        if path == place / entry.file:
            metadata = {**metadata, "scores": {**metadata.get("scores", {}), **entry.scores}}
    return loaded, {**metadata, "name": str(name), "file": path.name}


def add_to_zoo(
    weights: str | Path,
    name: str | None = None,
    scores: Mapping[str, float] | None = None,
    note: str = "",
    zoo: Path = ZOO,
) -> ZooEntry:
    """Copy a weight file into the zoo and enter it into the index, replacing one of that name.

    What tells the kind of object goes into the zoo's folder `kind`.

    `name` is the category unless given; `scores` are added to those in the file. Raises ModelError
    for a file that is damaged or larger than 8 MB, OutputError if the zoo cannot be written.
    """
    path = find_weights(weights, zoo)
    metadata = read_metadata(path)
    size = path.stat().st_size
    if size > LARGEST:
        raise ModelError(
            f"{path} has {size / 1e6:.1f} MB; the zoo takes at most {LARGEST / 1e6:.0f} MB: "
            "train a smaller field"
        )
    if metadata["preset"] == KIND:
        zoo = zoo / metadata["preset"]
    name = name or str(metadata["category"])
    fault = file_name_problem(name) or (
        ""
        if name.isprintable() and name == Path(name).name
        else "it may have no separators, because it becomes a file name"
    )
    if fault:
        raise ModelError(f"'{name}' is no name for a model: {fault}")
    entry = ZooEntry(
        name=name,
        file=f"{name}.safetensors",
        sha256=_sha256(path),
        bytes=size,
        category=str(metadata["category"]),
        preset=str(metadata["preset"]),
        scores={**metadata.get("scores", {}), **(scores or {})},
        shapes=metadata.get("shapes", {}),
        commit=metadata.get("commit"),
        date=metadata.get("date"),
        note=note,
    )
    entries = {known.name: known for known in _read_index(zoo)} | {name: entry}
    try:
        zoo.mkdir(parents=True, exist_ok=True)
        content = path.read_bytes()
    except OSError as error:
        raise OutputError(f"cannot write to the zoo {zoo}: {error.strerror or error}") from None
    write_atomically(zoo / entry.file, [content])
    _write_index(zoo, entries)
    log.info("%s is in the zoo as '%s'", path, name)
    return entry


def _write_index(zoo: Path, entries: Mapping[str, ZooEntry]) -> None:
    models = {}
    for name in sorted(entries):
        models[name] = asdict(entries[name])
        del models[name]["name"]
    text = json.dumps({"models": models}, indent=2, ensure_ascii=False)
    write_atomically(zoo / INDEX, [f"{text}\n".encode()])


def _verified(zoo: Path, entry: ZooEntry) -> Path:
    path = zoo / entry.file
    if not path.is_file():
        raise ModelError(f"the zoo's file {path} is missing; {_mend(zoo)}")
    if _sha256(path) != entry.sha256:
        raise ModelError(
            f"the zoo's file {path} was altered or truncated: its SHA-256 is not the one in "
            f"{INDEX}; {_mend(zoo)}"
        )
    return path


def _mend(zoo: Path) -> str:
    if zoo == user_zoo():
        return f"learn it again (nrdf model learn), or delete the folder {zoo}"
    return "install nrdf again"


def _sha256(path: Path) -> str:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise ModelError(f"cannot read {path}: {error.strerror or error}") from None
