"""From the words of a command line to a call of a verb: its options, their help, its mistakes."""

from __future__ import annotations

import difflib
import functools
import inspect
import io
import os
import re
import shutil
import textwrap
import typing
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from typing import Annotated, Any

from nrdf.commands.options import metavar_of
from nrdf.errors import ConfigError

Verb = Callable[..., Any]

_WIDEST = 100  # columns of a help text, however wide the terminal is
_POSITIONAL = "Positional"


def parse(verb: Verb, prog: str, words: list[str]) -> Callable[[], Any] | None:
    """The call that `words` ask for, with its numbers checked; None where they asked for help.

    The help is printed. Raises ConfigError for an unknown or missing option and for a value that
    does not fit.
    """
    import tyro

    if "-h" not in words and "--help" not in words:
        _check_flags(verb, prog, words)
    printed, complaint = io.StringIO(), io.StringIO()
    try:
        with _narrow(), redirect_stdout(printed), redirect_stderr(complaint):
            return tyro.cli(
                _for_tyro(verb),
                prog=prog,
                args=words,
                config=(tyro.conf.FlagCreatePairsOff,),
            )
    except SystemExit as ended:
        if ended.code:
            raise ConfigError(f"{_in_brief(complaint.getvalue())}\nsee {prog} --help") from None
    print_wrapped(printed.getvalue())
    return None


def print_wrapped(text: str) -> None:
    """Print a help text, its paragraphs wrapped to the terminal; indented lines are already."""
    from nrdf.commands.console import console

    for line in map(str.rstrip, text.rstrip().splitlines()):
        console.print(line if line.startswith(" ") else textwrap.fill(line, _width()))


def _width() -> int:
    return min(shutil.get_terminal_size().columns, _WIDEST)


@contextmanager
def _narrow() -> Iterator[None]:
    """A block in which tyro, which asks for the terminal's width, writes lines that can be read."""
    before = os.environ.get("COLUMNS")
    os.environ["COLUMNS"] = str(_width())
    try:
        yield
    finally:
        del os.environ["COLUMNS"]
        if before is not None:
            os.environ["COLUMNS"] = before


def closest(word: str, known: Iterable[str]) -> str:
    """The end of a message: the known word most like `word`, or nothing where none is like it."""
    near = difflib.get_close_matches(word, list(known), 1)
    return f"; did you mean '{near[0]}'?" if near else ""


def checked_call(verb: Verb, given: Mapping[str, Any]) -> Callable[[], Any]:
    """The call of a verb with these arguments.

    Raises ConfigError for a number that is outside the bounds in the verb's annotations.
    """
    from nrdf.io.bounds import check_numbers

    hints = _hints(verb)
    check_numbers(
        {flag(name): value for name, value in given.items()},
        {flag(name): hints[name] for name in given},
    )
    return functools.partial(verb, **given)


def flags_of(verb: Verb) -> dict[str, inspect.Parameter]:
    """The verb's flags ("--min-coverage") and their parameters, without the positional ones."""
    hints = _hints(verb)
    return {
        flag(name): parameter
        for name, parameter in inspect.signature(verb).parameters.items()
        if not _is_positional(hints[name])
    }


def flag(name: str) -> str:
    """The flag of a parameter."""
    return f"--{name.replace('_', '-')}"


def _check_flags(verb: Verb, prog: str, words: list[str]) -> None:
    known, given = flags_of(verb), set()
    for word in words:
        if word.startswith("--"):
            name = word.partition("=")[0].replace("_", "-")
            if name not in known:
                raise ConfigError(
                    f"{prog} has no option {name}{closest(name, known)}\nsee {prog} --help"
                )
            given.add(name)
    missing = [n for n, p in known.items() if p.default is p.empty and n not in given]
    if missing:
        raise ConfigError(f"{prog} needs {', '.join(missing)}\nsee {prog} --help")


def _for_tyro(verb: Verb) -> Verb:
    """The verb as tyro should see it: it gives the checked call instead of running it."""
    hints, signature = _hints(verb), inspect.signature(verb)

    @functools.wraps(verb)
    def call(*values: Any, **named: Any) -> Callable[[], Any]:
        return checked_call(verb, signature.bind(*values, **named).arguments)

    shown = {
        name: _shown(name, hints[name], parameter.default)
        for name, parameter in signature.parameters.items()
    }
    call.__annotations__ = shown
    call.__signature__ = signature.replace(  # type: ignore[attr-defined]
        parameters=[p.replace(annotation=shown[n]) for n, p in signature.parameters.items()],
        return_annotation=inspect.Signature.empty,
    )
    call.__doc__ = _unbroken(inspect.getdoc(verb) or "")
    del call.__wrapped__  # type: ignore[attr-defined]  # tyro would look there instead
    return call


def _unbroken(text: str) -> str:
    """A docstring with one line a paragraph and one an argument: tyro would keep the breaks."""
    head, mark, arguments = text.partition("\n\nArgs:\n")
    paragraphs = (" ".join(paragraph.split()) for paragraph in head.split("\n\n"))
    return "\n\n".join(paragraphs) + mark + re.sub(r"\n {8,}", " ", arguments)


def _shown(name: str, hint: Any, default: Any) -> Any:
    """The annotation with the metavar and the default as `--help` shows them."""
    from tyro.conf import arg

    if default is inspect.Parameter.empty:
        hint_of_default = "(required)"
    elif default is None or default is False or default in ((), ""):
        hint_of_default = ""  # the description says what happens without it
    else:
        listed = default if isinstance(default, tuple) else (default,)
        values = (f"{v:g}" if isinstance(v, float) else str(v) for v in listed)
        hint_of_default = f"(default: {' '.join(values)})"
    metavar = None if hint is bool else metavar_of(name, hint)
    return Annotated[hint, arg(metavar=metavar, help_behavior_hint=hint_of_default)]


def _in_brief(complaint: str) -> str:
    """What tyro complains of, in one or a few lines: no frame, no repeated help, no type names."""
    blocks = re.split(r"^\W*-{3,}\W*$", complaint, flags=re.MULTILINE)
    lines = (line.strip() for line in blocks[min(1, len(blocks) - 1)].splitlines())
    text = " ".join(line for line in lines if line and "NoneType" not in line)
    value = re.match(r"Error parsing (\S+): .*- .*[\]>]: (.*)", text)
    if value:
        return f"{value[1]}: {value[2]}"
    return text.replace("Error parsing ", "").replace("{None}|", "").replace("{None,", "{")


def _hints(verb: Verb) -> Mapping[str, Any]:
    return typing.get_type_hints(verb, include_extras=True)


def _is_positional(hint: Any) -> bool:
    return any(_POSITIONAL in repr(mark) for mark in getattr(hint, "__metadata__", ()))
