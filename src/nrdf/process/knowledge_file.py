"""Knowledge files: YAML or JSON, read with every fault named, written whole with comments."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from nrdf.errors import ProcessError
from nrdf.io.atomic import write_atomically
from nrdf.io.files import read_file
from nrdf.io.schema import Location, validation_messages
from nrdf.io.yaml_json import read_json, read_yaml
from nrdf.process.knowledge import VERSION, Knowledge
from nrdf.process.knowledge_text import to_yaml

_LARGEST_FILE = 1 << 27
_MOST_FAULTS = 12


def read_knowledge(path: str | Path) -> Knowledge:
    """Knowledge from a YAML or JSON file (by its ending `.json`).

    Raises ProcessError for a file that is missing, no YAML or JSON mapping, from a newer version
    of this format, or wrong somewhere: every fault is listed with its field, its value and, for an
    unknown key, the nearest known one.
    """
    path = Path(path)
    if not path.exists():
        raise ProcessError(f"no knowledge file {path}; `nrdf teach` writes one")
    try:
        text = read_file(path, ProcessError, _LARGEST_FILE).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ProcessError(f"{path} is no text in UTF-8: {error}") from None
    return parse_knowledge(text, str(path), as_json=path.suffix.lower() == ".json")


def parse_knowledge(text: str, origin: str, as_json: bool = False) -> Knowledge:
    """Knowledge from the text of a file; `origin` names it in errors, raised as `read_knowledge`
    does."""
    kind = "JSON" if as_json else "YAML"
    try:
        content = read_json(text) if as_json else read_yaml(text)
    except ValueError as error:
        raise ProcessError(f"{origin} is not valid {kind}: {error}") from None
    if not isinstance(content, dict):
        raise ProcessError(f"{origin} must hold a mapping (category: …, reference: …, regions: …)")
    version = content.get("version", VERSION)
    if isinstance(version, int) and version > VERSION:
        raise ProcessError(
            f"{origin} has version {version}, from a newer nrdf; this one reads version {VERSION}: "
            "update nrdf"
        )
    if isinstance(version, int) and version < VERSION:
        raise ProcessError(
            f"{origin} has version {version}, which never was a version of this format; change it "
            f"to version: {VERSION}"
        )
    return validated(content, origin)


def validated(content: dict[str, Any], origin: str) -> Knowledge:
    """Knowledge from a mapping as a file holds it. Raises ProcessError listing every fault."""
    try:
        return Knowledge.model_validate(content)
    except ValidationError as error:
        place = partial(_place, content=content)
        faults = validation_messages(error, Knowledge, place, _MOST_FAULTS)
        raise ProcessError(listed(origin, faults, error.error_count())) from None


def listed(origin: str, faults: list[str], count: int | None = None) -> str:
    """One message of several faults, a line each; `count`: of all, where some are not given."""
    count = count or len(faults)
    if count == 1:
        return f"{origin}: {faults[0]}"
    shown = faults[:_MOST_FAULTS]
    if count > len(shown):
        shown.append(f"and {count - len(shown)} more")
    return "\n  ".join([f"{origin}: {count} faults:", *shown])


def write_knowledge(path: str | Path, knowledge: Knowledge, explained: bool = False) -> None:
    """Write a knowledge file, whole or not at all: JSON if `path` ends so, else YAML.

    YAML shows millimetres, degrees and rpm beside SI values; `explained` writes every field once
    with what it means, also those that are not set. Raises OutputError if it cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() == ".json":
        content = knowledge.model_dump(mode="json", exclude_defaults=True)
        text = json.dumps({"version": VERSION, **content}, indent=1, ensure_ascii=False) + "\n"
    else:
        text = to_yaml(knowledge, explained)
    write_atomically(path, [text.encode()])


def _place(location: Location, content: dict[str, Any]) -> str:
    """Where in a knowledge file: "region 'seat', process 2 (oil): feed_m_s"."""
    words: list[str] = []
    at: Any = content
    rest = list(location)
    while len(rest) >= 2 and rest[0] in ("regions", "processes", "waypoints"):
        kind_of, number = rest[0], rest[1]
        if not isinstance(number, int):
            break
        try:
            at = at[kind_of][number]
        except (KeyError, IndexError, TypeError):
            at = None
        known = at if isinstance(at, dict) else {}
        if kind_of == "regions":
            name = known.get("name")
            words.append(f"region '{name}'" if isinstance(name, str) else f"region {number + 1}")
        elif kind_of == "processes":
            kind = f" ({known['kind']})" if isinstance(known.get("kind"), str) else ""
            words.append(f"process {number + 1}{kind}")
        else:
            words.append(f"line {number + 1}")
        rest = rest[2:]
    if rest:
        words.append(".".join(map(str, rest)))
    return ", ".join(words)
