"""Knowledge files: YAML or JSON, read with every fault named, written whole with comments."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from nrdf.io.atomic import write_atomically
from nrdf.io.model_file import ModelFile
from nrdf.io.schema import Location
from nrdf.process.knowledge import VERSION, Knowledge
from nrdf.process.knowledge_text import to_yaml


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


KNOWLEDGE_FILE = ModelFile(
    Knowledge, "knowledge", "nrdf teach", "category: …, reference: …, regions: …", VERSION, 1 << 27,
    _place,
)  # fmt: skip
"""How knowledge files are read."""


def read_knowledge(path: str | Path) -> Knowledge:
    """Knowledge from a file. Raises ProcessError, as `ModelFile.read` does."""
    return KNOWLEDGE_FILE.read(path)


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
