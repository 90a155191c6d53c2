"""YAML and JSON that people write, as plain values: mappings, lists, text, numbers, true and false.

A file may come from anybody. Nothing in it is run and no tag makes an object. Its depth, its
numbers and the size of its aliases are limited while it is read. A key that occurs twice is an
error. Values are read as people mean them: 1e-3 is a number; dates, 0x10 and 1:30 are text.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import yaml

MAX_VALUES = 5_000_000
"""Of a file, those behind YAML's aliases counted as often as they are used."""
MAX_KEYS = 100_000
"""Of a file, all mappings together."""
MAX_DEPTH = 50
"""Mappings and lists within each other."""
MAX_DIGITS = 100
"""Digits and signs."""

_PARSER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_WORDS = {"": None, "~": None, "null": None, "Null": None, "NULL": None} | {
    written: value
    for words, value in (("true yes on", True), ("false no off", False))
    for word in words.split()
    for written in (word, word.capitalize(), word.upper())
}
_INTEGER = re.compile(r"[-+]?(0|[1-9][0-9_]*)")
_FLOAT = re.compile(r"[-+]?([0-9][0-9_]*\.[0-9_]*|\.[0-9][0-9_]*|[0-9]+(?=[eE]))([eE][-+]?[0-9]+)?")
_SPECIAL = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")


def read_yaml(text: str) -> Any:
    """The plain value of a YAML document.

    Raises ValueError, naming the line, for text that is no YAML, several documents, tags, aliases
    without or within their anchor, a repeated key, and what is too deep, too long or too much.
    """
    reader = _Reader()
    try:
        for event in yaml.parse(text, Loader=_PARSER):
            reader.take(event)
    except yaml.YAMLError as error:
        raise ValueError(str(error)) from None
    return reader.root


def read_json(text: str) -> Any:
    """The plain value of a JSON text. Raises ValueError as `read_yaml` does."""
    # Each value but the first of a mapping or list comes after a comma, each key before a colon.
    if text.count(",") > MAX_VALUES:
        raise ValueError(_TOO_MANY)
    if text.count(":") > MAX_KEYS:
        raise ValueError(_TOO_MANY_KEYS)
    try:
        read = json.loads(
            text, parse_int=_whole, parse_float=_decimal, parse_constant=_no_constant,
            object_pairs_hook=_mapping,
        )  # fmt: skip
    except RecursionError:
        raise ValueError(_TOO_DEEP) from None
    deep = [read]
    for _ in range(MAX_DEPTH):
        deep = [inner for outer in deep for inner in _inside(outer)]
    if any(isinstance(value, (dict, list)) for value in deep):
        raise ValueError(_TOO_DEEP)
    return read


def to_yaml_line(value: Any) -> str:
    """A plain value as YAML on one line, which `read_yaml` reads as the same."""
    text = yaml.dump(
        value, Dumper=_Dumper, default_flow_style=True, allow_unicode=True, sort_keys=False,
        width=float("inf"),
    )  # fmt: skip
    return text.removesuffix("\n").removesuffix("\n...")


_TOO_MANY = f"more than {MAX_VALUES:,} values, aliases included"
_TOO_MANY_KEYS = f"more than {MAX_KEYS:,} keys"
_TOO_DEEP = f"mappings and lists are nested more than {MAX_DEPTH} deep"


@dataclass
class _Open:
    """A mapping or list that is being read. before: how many values the file had before it."""

    content: dict[str, Any] | list[Any]
    anchor: str | None
    before: int
    key: str | None = None
    merged: list[dict[str, Any]] = field(default_factory=list)


@dataclass
class _Reader:
    """Puts a document together from its events; nothing here calls itself, so depth costs little.

    anchors: name to value and how many values it stands for.
    """

    root: Any = None
    documents: int = 0
    count: int = 0
    keys: int = 0
    open: list[_Open] = field(default_factory=list)
    anchors: dict[str, tuple[Any, int]] = field(default_factory=dict)

    def take(self, event: yaml.Event) -> None:
        if isinstance(event, yaml.ScalarEvent):
            self._refuse_tag(event)
            plain = event.implicit[0]
            is_key = self._awaits_key()
            # Keys are text, whatever they look like.
            value = event.value if is_key or not plain else _at(event, _scalar, event.value)
            self._add(event, value)
            if event.anchor is not None:
                self.anchors[event.anchor] = (value, 1)
        elif isinstance(event, (yaml.MappingStartEvent, yaml.SequenceStartEvent)):
            self._refuse_tag(event)
            if self._awaits_key():
                raise ValueError(f"line {_line(event)}: a key must be text")
            if len(self.open) >= MAX_DEPTH:
                raise ValueError(f"line {_line(event)}: {_TOO_DEEP}")
            content: dict[str, Any] | list[Any]
            content = {} if isinstance(event, yaml.MappingStartEvent) else []
            self.open.append(_Open(content, event.anchor, self.count))
        elif isinstance(event, (yaml.MappingEndEvent, yaml.SequenceEndEvent)):
            self._close(event)
        elif isinstance(event, yaml.AliasEvent):
            self._alias(event)
        elif isinstance(event, yaml.DocumentStartEvent):
            self.documents += 1
            if self.documents > 1:
                raise ValueError(f"line {_line(event)}: a second document begins; one is enough")

    def _awaits_key(self) -> bool:
        return bool(self.open) and isinstance(self.open[-1].content, dict) and (
            self.open[-1].key is None
        )  # fmt: skip

    def _add(self, event: yaml.Event, value: Any, amount: int = 1) -> None:
        """Put a value, or a key, where it belongs."""
        self.count += amount
        if self.count > MAX_VALUES:
            raise ValueError(_TOO_MANY)
        if not self.open:
            self.root = value
            return
        holder = self.open[-1]
        if isinstance(holder.content, list):
            holder.content.append(value)
        elif holder.key is None:
            if not isinstance(value, str):
                raise ValueError(f"line {_line(event)}: a key must be text")
            if value in holder.content:
                raise ValueError(f"the key '{value}' occurs twice, again in line {_line(event)}")
            holder.key = value
            self.keys += 1
            if self.keys > MAX_KEYS:
                raise ValueError(_TOO_MANY_KEYS)
        else:
            if holder.key == "<<":
                holder.merged += _mappings(event, value)
            else:
                holder.content[holder.key] = value
            holder.key = None

    def _close(self, event: yaml.Event) -> None:
        done = self.open.pop()
        if isinstance(done.content, dict) and done.merged:
            taken: dict[str, Any] = {}
            for other in reversed(done.merged):
                taken.update(other)
            done.content = {**taken, **done.content}
        if done.anchor is not None:
            self.anchors[done.anchor] = (done.content, self.count - done.before + 1)
        self._add(event, done.content)

    def _alias(self, event: yaml.AliasEvent) -> None:
        name = event.anchor
        if any(holder.anchor == name for holder in self.open):
            raise ValueError(
                f"line {_line(event)}: the alias *{name} stands within its own anchor &{name}"
            )
        if name not in self.anchors:
            raise ValueError(f"line {_line(event)}: no anchor &{name} stands before *{name}")
        self._add(event, *self.anchors[name])

    def _refuse_tag(self, event: Any) -> None:
        if event.tag is not None:
            shown = event.tag.replace("tag:yaml.org,2002:", "!!")
            raise ValueError(
                f"line {_line(event)}: the tag {shown} is not understood; write the value alone, "
                "text in quotes"
            )


def _mappings(event: yaml.Event, value: Any) -> list[dict[str, Any]]:
    """What `<<` takes over: a mapping, or several, of which the first counts most."""
    several = value if isinstance(value, list) else [value]
    if not all(isinstance(one, dict) for one in several):
        raise ValueError(f"line {_line(event)}: << needs a mapping, or a list of them")
    return several


def _scalar(text: str) -> Any:
    if text in _WORDS:
        return _WORDS[text]
    if _INTEGER.fullmatch(text):
        return _whole(text.replace("_", ""))
    if _FLOAT.fullmatch(text):
        return _decimal(text.replace("_", ""))
    return float(text.replace(".", "", 1)) if _SPECIAL.fullmatch(text) else text


def _whole(text: str) -> int:
    return int(_short(text))


def _decimal(text: str) -> float:
    return float(_short(text))


def _short(text: str) -> str:
    if len(text) > MAX_DIGITS:
        raise ValueError(f"a number of {len(text)} digits; {MAX_DIGITS} are the most")
    return text


def _no_constant(name: str) -> float:
    raise ValueError(f"{name} is no number")


def _inside(value: Any) -> Iterable[Any]:
    return value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()


def _mapping(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    made = dict(pairs)
    if len(made) < len(pairs):
        seen: set[str] = set()
        twice = next(key for key, _ in pairs if key in seen or seen.add(key))  # type: ignore[func-returns-value]
        raise ValueError(f"the key '{twice}' occurs twice")
    return made


def _at(event: yaml.Event, make: Any, text: str) -> Any:
    try:
        return make(text)
    except ValueError as error:
        raise ValueError(f"line {_line(event)}: {error}") from None


def _line(event: yaml.Event) -> int:
    return int(event.start_mark.line) + 1  # type: ignore[union-attr]


class _Dumper(yaml.SafeDumper):
    """Puts text in quotes that would be read as a number, or would take more than one line."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def _text(dumper: yaml.SafeDumper, value: str) -> yaml.ScalarNode:
    style = None if value.isprintable() else '"'
    return dumper.represent_scalar("tag:yaml.org,2002:str", value, style)


_Dumper.add_representer(str, _text)
_Dumper.add_implicit_resolver("tag:yaml.org,2002:float", _FLOAT, list("-+.0123456789"))
