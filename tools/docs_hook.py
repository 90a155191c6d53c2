"""Pages of the documentation that are made from the code: commands, Python names, file schemas.

A hook of MkDocs (https://www.mkdocs.org/user-guide/configuration/#hooks), named in mkdocs.yml.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[1]


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the generated pages."""
    made = {
        "reference/commands.md": commands(),
        "reference/python.md": python_names(),
        "reference/knowledge-file.md": knowledge_file(),
        "reference/configs.md": configurations(),
    }
    for name, text in made.items():
        written = files.get_file_from_path(name)
        if written is not None:
            files.remove(written)
        files.append(File.generated(config, name, content=text))
    return files


def commands() -> str:
    """Every command's own help."""
    parts = [
        "# Commands",
        "The text of `nrdf --help`, and of `nrdf VERB --help` for each verb.",
        _block(_help([])),
    ]
    for words in _verbs():
        parts += [f"{'#' * (1 + len(words))} nrdf {' '.join(words)}", _block(_help(list(words)))]
    return "\n\n".join(parts) + "\n"


def _verbs() -> Iterator[tuple[str, ...]]:
    from nrdf.cli import GROUPS, verbs

    known = verbs()
    for name, verb in known.items():
        yield (name,)
        if name in GROUPS:
            for inner in verb():
                yield (name, inner)


def _help(words: list[str]) -> str:
    from nrdf import cli

    os.environ["COLUMNS"] = "80"
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.suppress(SystemExit):
        cli.run([*words, "--help"])
    plain = re.sub(r"\x1b\[[0-9;]*m", "", said.getvalue())
    return "\n".join(line.rstrip() for line in plain.splitlines())


def python_names() -> str:
    """The public names of `nrdf`, by what they are, for mkdocstrings."""
    import nrdf

    text = (ROOT / "docs" / "reference" / "python.md").read_text(encoding="utf-8")
    names = [name for name in nrdf.__all__ if not name.startswith("__")]
    groups = {
        "Functions": [n for n in names if n[0].islower()],
        "Classes": [n for n in names if n[0].isupper() and not n.endswith("Error")],
        "Errors": [n for n in names if n.endswith("Error")],
    }
    for title, members in groups.items():
        text += f"\n## {title}\n\n"
        for name in members:
            home = getattr(import_module("nrdf"), name).__module__
            text += f"::: {home}.{name}\n\n"
    return text


def knowledge_file() -> str:
    """The knowledge file's JSON Schema, as tables."""
    from nrdf.process.knowledge import Knowledge

    schema = Knowledge.model_json_schema()
    parts = [
        "# Knowledge file",
        "Every key of a knowledge file, from its JSON Schema (`nrdf teach --schema` prints it). "
        "What they are for: [Teach a process](../guides/teach.md).",
        "## The file itself",
        _table(schema),
    ]
    for name, part in sorted(schema.get("$defs", {}).items()):
        if part.get("properties"):
            about = " ".join(part.get("description", "").split())
            parts += [f"## {name}", about, _table(part)]
    return "\n\n".join(parts) + "\n"


def _table(schema: dict[str, Any]) -> str:
    rows = ["| key | type | unless given | meaning |", "|---|---|---|---|"]
    needed = schema.get("required", [])
    for key, part in schema["properties"].items():
        default = "needed" if key in needed else _code(part.get("default"))
        meaning = " ".join(str(part.get("description", "")).split()).replace("|", "\\|")
        rows.append(f"| `{key}` | {_type(part)} | {default} | {meaning} |")
    return "\n".join(rows)


def _type(part: dict[str, Any]) -> str:
    if "$ref" in part:
        name = part["$ref"].rpartition("/")[2]
        return f"[{name}](#{name.lower()})"
    if "enum" in part:
        return ", ".join(_code(value) for value in part["enum"])
    if "const" in part:
        return _code(part["const"])
    if "anyOf" in part:
        kinds = [_type(option) for option in part["anyOf"] if option.get("type") != "null"]
        return " or ".join(dict.fromkeys(kinds))
    if part.get("type") == "array" and isinstance(part.get("items"), dict):
        return f"list of {_type(part['items'])}"
    return str(part.get("type", "anything"))


def _code(value: Any) -> str:
    return "" if value is None else f"`{json.dumps(value)}`"


def configurations() -> str:
    """The training configurations that ship, whole."""
    parts = [
        "# Training configurations",
        "What `nrdf model train --preset NAME` reads. A copy of one, changed, can be given as a "
        "file. `nrdf.training.config` explains every key.",
    ]
    for path in sorted((ROOT / "src" / "nrdf" / "configs").glob("*.yaml")):
        parts += [f"## {path.stem}", _block(path.read_text(encoding="utf-8").rstrip(), "yaml")]
    return "\n\n".join(parts) + "\n"


def _block(text: str, language: str = "text") -> str:
    return f"````{language}\n{text}\n````"
