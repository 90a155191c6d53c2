"""Names that are safe for files on Linux, macOS and Windows."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable

WINDOWS_DEVICES = frozenset(
    ["con", "prn", "aux", "nul", *(f"{kind}{n}" for kind in ("com", "lpt") for n in range(10))]
)
"""File names that Windows, and so many a controller, keeps for itself."""
MAX_NAME_BYTES = 200
"""Bytes that a name may have: file systems take 255, and endings come on top."""


def file_name_problem(name: str) -> str:
    """Why `name`, with an ending, is no good name for a file; "" where it is one.

    The caller checks for separators and for the characters that it allows.
    """
    size = len(name.encode("utf-8", "surrogatepass"))
    if size > MAX_NAME_BYTES:
        return f"it has {size} bytes, and a file's name has room for {MAX_NAME_BYTES}: shorten it"
    if name.endswith((".", " ")):
        return "it ends with a dot or a space, which Windows leaves out"
    if _is_device(name):
        return f"Windows keeps {name.partition('.')[0]} for a device: give another name"
    return ""


def safe_file_name(name: str, otherwise: str) -> str:
    """The name nearest to `name` that a file can have on every system; `otherwise` where nothing
    is left of it."""
    name = re.sub(r"[^\w .+-]", "-", name).strip(". ")
    while len(name.encode("utf-8", "surrogatepass")) > MAX_NAME_BYTES:
        name = name[:-1].rstrip(". ")
    return f"{name}-" if _is_device(name) else name or otherwise


def clashing_names(names: Iterable[str]) -> tuple[str, str] | None:
    """Two of `names` that would be one file where capitals or ways to write accents do not count,
    as on Windows and macOS; None where there are none."""
    known: dict[str, str] = {}
    for name in names:
        key = unicodedata.normalize("NFC", unicodedata.normalize("NFC", name).casefold())
        if key in known:
            return known[key], name
        known[key] = name
    return None


def spreadsheet_text(text: str) -> str:
    """`text` for a cell of a table that no spreadsheet takes for a formula: after a ' where it
    begins like one. Numbers are not text: they stay as they are."""
    return f"'{text}" if text.startswith(_FORMULA) else text


_FORMULA = ("=", "+", "-", "@", "＝", "＋", "－", "＠", "\t", "\r", "\n")


def _is_device(name: str) -> bool:
    return name.partition(".")[0].strip().lower() in WINDOWS_DEVICES
