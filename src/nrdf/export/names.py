"""Names and numbers in programs: nothing in them can be mistaken for a statement or a path."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable

from nrdf.errors import ProcessError
from nrdf.export.options import Options
from nrdf.io.file_names import WINDOWS_DEVICES
from nrdf.toolpath.types import Job


def plain_text(text: str) -> str:
    """`text` for comments: accents dropped; all but A-Z a-z 0-9 . + - _ and spaces turned to _."""
    letters = (c for c in unicodedata.normalize("NFKD", text) if not unicodedata.combining(c))
    return re.sub(r"[^A-Za-z0-9 .+_-]", "_", "".join(letters)).strip() or "unnamed"


def identifier(text: str, longest: int) -> str:
    """A name of letters, digits and _ that begins with a letter, of at most `longest` characters.

    Every language and file system that is written for takes it.
    """
    word = re.sub(r"[^A-Za-z0-9]+", "_", plain_text(text)).strip("_")
    if not word or not word[0].isalpha():
        word = f"n_{word}".rstrip("_")
    return word[:longest].rstrip("_")


def identifiers(names: Iterable[str], longest: int, language: str) -> dict[str, str]:
    """An identifier for each of `names`, which a language without capitals can tell apart.

    Raises ProcessError for two names that become one.
    """
    made: dict[str, str] = {}
    for name in names:
        word = identifier(name, longest)
        twin = next((n for n, w in made.items() if n != name and w.lower() == word.lower()), None)
        if twin is not None:
            raise ProcessError(
                f"the tools '{twin}' and '{name}' would both be called {word} in {language}; "
                "rename one in the process knowledge"
            )
        made[name] = word
    return made


def routine_names(job: Job, longest: int) -> list[str]:
    """An identifier for each path of `job`: p, its number, its region."""
    return [identifier(f"p{i} {path.region}", longest) for i, path in enumerate(job.paths, start=1)]


def program_name(job: Job, options: Options, longest: int, language: str, words: str = "") -> str:
    """The program's name as an identifier of a language whose own words (lower case) are `words`.

    Raises ProcessError for a name that the language or the file system keeps for itself.
    """
    name = identifier(options.program or f"nrdf_{job.category}", longest)
    if name.lower() in WINDOWS_DEVICES or name.lower() in words.split():
        raise ProcessError(
            f"--program {name}: {language} has a use of its own for this name; give another"
        )
    return name


def number(value: float, decimals: int) -> str:
    """`value` with a decimal point and no exponent; never -0."""
    text = f"{value:.{decimals}f}"
    return text.removeprefix("-") if not text.strip("-0.") else text


def numbers(values: Iterable[float], decimals: int) -> list[str]:
    """Each of `values` as `number` writes it."""
    return [number(float(value), decimals) for value in values]
