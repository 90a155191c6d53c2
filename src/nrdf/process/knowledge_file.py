"""Knowledge files: YAML or JSON, read with every fault named, written whole with comments."""

from __future__ import annotations

import json
import re
from collections.abc import Hashable
from pathlib import Path
from typing import Any

import yaml
from pydantic import ValidationError

from nrdf.errors import ProcessError
from nrdf.ply import write_atomically
from nrdf.process.knowledge import VERSION, Knowledge
from nrdf.process.knowledge_text import to_yaml
from nrdf.strict import Location, explain

_LARGEST_FILE = 1 << 27
_MOST_VALUES = 20_000_000
"""A file's values, those behind YAML's aliases counted as often as they are used."""
_MOST_FAULTS = 12


def read_knowledge(path: str | Path) -> Knowledge:
    """Knowledge from a YAML or JSON file (by its ending `.json`).

    Raises ProcessError for a file that is missing, no YAML or JSON mapping, from a newer version
    of this format, or wrong somewhere: every fault is listed with its field, its value and, for an
    unknown key, the nearest known one.
    """
    path = Path(path)
    try:
        if path.stat().st_size > _LARGEST_FILE:
            raise ProcessError(f"{path} is larger than {_LARGEST_FILE >> 20} MiB")
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise ProcessError(
            f"cannot read the knowledge file {path}: {error.strerror or error}; "
            "`nrdf knowledge new` writes one"
        ) from None
    except UnicodeDecodeError as error:
        raise ProcessError(f"{path} is no text in UTF-8: {error}") from None
    return parse_knowledge(text, str(path), as_json=path.suffix.lower() == ".json")


def parse_knowledge(text: str, origin: str, as_json: bool = False) -> Knowledge:
    """Knowledge from the text of a file; `origin` names it in errors, raised as `read_knowledge`
    does."""
    kind = "JSON" if as_json else "YAML"
    try:
        content = json.loads(text) if as_json else yaml.load(text, Loader=_Loader)
        _check_size(content)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise ProcessError(f"{origin} is not valid {kind}: {error}") from None
    if not isinstance(content, dict):
        raise ProcessError(f"{origin} must hold a mapping (category: …, reference: …, regions: …)")
    version = content.get("version", VERSION)
    if isinstance(version, int) and version > VERSION:
        raise ProcessError(
            f"{origin} has version {version}, from a newer nrdf; this one reads version {VERSION}: "
            "update nrdf"
        )
    return validated(content, origin)


def validated(content: dict[str, Any], origin: str) -> Knowledge:
    """Knowledge from a mapping as a file holds it. Raises ProcessError listing every fault."""
    try:
        return Knowledge.model_validate(content)
    except ValidationError as error:
        faults = explain(error, Knowledge, lambda location: _place(location, content))
        raise ProcessError(listed(origin, faults)) from None


def listed(origin: str, faults: list[str]) -> str:
    """One message of several faults, a line each."""
    if len(faults) == 1:
        return f"{origin}: {faults[0]}"
    shown = faults[:_MOST_FAULTS]
    if len(faults) > len(shown):
        shown.append(f"and {len(faults) - len(shown)} more")
    return "\n  ".join([f"{origin}: {len(faults)} faults:", *shown])


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
        name, number = rest[0], rest[1]
        if not isinstance(number, int):
            break
        try:
            at = at[name][number]
        except (KeyError, IndexError, TypeError):
            at = None
        known = at if isinstance(at, dict) else {}
        if name == "regions":
            words.append(f"region '{known['name']}'" if "name" in known else f"region {number + 1}")
        elif name == "processes":
            kind = f" ({known['kind']})" if "kind" in known else ""
            words.append(f"process {number + 1}{kind}")
        else:
            words.append(f"line {number + 1}")
        rest = rest[2:]
    if rest:
        words.append(".".join(map(str, rest)))
    return ", ".join(words)


def _check_size(content: Any) -> None:
    """Raise ValueError for content that aliases blow up, or that contains itself."""
    sizes: dict[int, int] = {}
    open_now: set[int] = set()

    def size(value: Any) -> int:
        if not isinstance(value, (dict, list)):
            return 1
        if id(value) in open_now:
            raise ValueError("an alias (*name) stands within its own anchor (&name)")
        if id(value) not in sizes:
            open_now.add(id(value))
            items = value.values() if isinstance(value, dict) else value
            sizes[id(value)] = 1 + sum(map(size, items))
            open_now.remove(id(value))
        return sizes[id(value)]

    if size(content) > _MOST_VALUES:
        raise ValueError(f"more than {_MOST_VALUES} values, aliases included")


class _Loader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
    """YAML without its traps: 1e-3 is a number, and a key that occurs twice is an error."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        seen: set[str] = set()
        for key in (key for key, _ in node.value if isinstance(key, yaml.ScalarNode)):
            if key.value in seen and key.value != "<<":
                line = key.start_mark.line + 1
                raise yaml.YAMLError(f"the key '{key.value}' occurs twice, again in line {line}")
            seen.add(key.value)
        return super().construct_mapping(node, deep)  # type: ignore[no-any-return]


_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"^[-+]?(\d+(\.\d*)?|\.\d+)[eE][-+]?\d+$"),
    list("-+.0123456789"),
)
