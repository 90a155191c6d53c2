"""The command line: one verb per command, errors without tracebacks, an exit code for scripts."""

from __future__ import annotations

import functools
import inspect
import logging
import os
import re
import sys
import typing
from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import entry_points
from typing import Any

import nrdf
from nrdf.errors import ConfigError, NrdfError

USAGE = """usage: nrdf VERB ... [-v]

Teach a region once, on one object, and find it on every object of that kind.
"""
NOTES = """
Every verb explains itself, with an example:  nrdf VERB --help
-v shows debug messages; nrdf --version the version.
Ends with 0 where all is well; 1 where some shapes could not be used; 2 for bad
input, with a message that says what to do; 3 where a limit is not met, or with
--strict where anything is doubtful; 4 where nothing was found or could be
planned; 130 after Ctrl-C. With 3 and 4 the result is written all the same."""

RESUMABLE = (
    "synth",
    "prepare",
    "boxes",
    "correspond",
    "train",
    "yaw",
    "kind",
    "eval bsrc",
    "eval presence",
    "ablate",
)
GROUPS = ("eval", "knowledge")
"""Verbs that have verbs of their own: calling one gives them, name to function."""
BENCHMARK = ("eval", "ablate")
"""Verbs that come with `nrdf_benchmark`."""


def verbs() -> dict[str, Callable[..., Any]]:
    """Name to function; their modules import nothing heavy."""
    from nrdf.commands.align import align
    from nrdf.commands.export import export
    from nrdf.commands.information import info, zoo
    from nrdf.commands.kind import kind
    from nrdf.commands.knowledge import knowledge
    from nrdf.commands.retrieve import retrieve
    from nrdf.commands.scan import scan
    from nrdf.commands.shapes import boxes, correspond, prepare, synth
    from nrdf.commands.show import demo
    from nrdf.commands.simulate import simulate
    from nrdf.commands.studio import studio
    from nrdf.commands.train import train
    from nrdf.commands.transfer import transfer
    from nrdf.commands.yaw import yaw

    return {
        "retrieve": retrieve,
        "align": align,
        "knowledge": knowledge,
        "transfer": transfer,
        "export": export,
        "simulate": simulate,
        "demo": demo,
        "studio": studio,
        "info": info,
        "scan": scan,
        "synth": synth,
        "prepare": prepare,
        "boxes": boxes,
        "correspond": correspond,
        "train": train,
        "yaw": yaw,
        "kind": kind,
        "zoo": zoo,
        **_verbs_of_other_packages(),
    }


def _verbs_of_other_packages() -> dict[str, Callable[..., Any]]:
    """Verbs that installed packages add, as entry points of the group `nrdf.commands`."""
    found: dict[str, Callable[..., Any]] = {}
    for point in entry_points(group="nrdf.commands"):
        try:
            found[point.name] = point.load()
        except ModuleNotFoundError as error:
            # A package that is not there adds nothing; what fails inside one is a fault to see.
            if error.name != point.module.partition(".")[0]:
                raise
    return found


def _refuse_missing_benchmark(verb: str, known: Mapping[str, Any]) -> None:
    """Raises ConfigError for a verb of the benchmark where `nrdf_benchmark` is not installed."""
    if verb in BENCHMARK and verb not in known:
        raise ConfigError(
            f"`nrdf {verb}` is part of nrdf_benchmark, which is not installed; "
            "pip install 'nrdf[benchmark]'"
        )


def main(arguments: Sequence[str] | None = None) -> None:
    """Run one command and exit with its code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    verbose = any(word in ("-v", "--verbose") for word in given)
    given = [word for word in given if word not in ("-v", "--verbose")]
    sys.exit(run(given, verbose))


def run(given: list[str], verbose: bool = False) -> int:
    """Run one command; the exit code."""
    _configure_logging(verbose)
    try:
        if given in ([], ["-h"], ["--help"]):
            _show_verbs()
            return 0
        if given == ["--version"]:
            _say(f"nrdf {nrdf.__version__}")
            return 0
        return _parse(_with_axes_joined(given)) or 0
    except NrdfError as error:
        _complain(str(error))
        return error.exit_code
    except BrokenPipeError:
        # The reader of our output has gone (`nrdf info | head`): nothing more to say.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except OSError as error:
        # A disk that fills up, a folder that goes away: the machine's answer, and no bug of ours.
        logging.getLogger("nrdf").debug("where it happened", exc_info=True)
        where = f" ({error.filename})" if error.filename else ""
        _complain(f"the system refused: {error.strerror or error}{where}")
        return 2
    except KeyboardInterrupt:
        _complain("interrupted" + "; the same command goes on where it was" * _resumable(given))
        return 130


def _resumable(given: list[str]) -> bool:
    # What `nrdf eval` measures is kept only where there is a folder for it.
    kept = given[0] not in GROUPS or any(word.partition("=")[0] == "--out" for word in given)
    return kept and (given[0] in RESUMABLE or " ".join(given[:2]) in RESUMABLE)


def _parse(given: list[str]) -> int | None:
    """Parse and run, one level deeper where the verb is a group."""
    import tyro

    known, prog, description = verbs(), "nrdf", None
    _refuse_missing_benchmark(given[0], known)
    if given[0] in GROUPS:
        group = known[given[0]]
        known, prog, description = group(), f"nrdf {given[0]}", inspect.getdoc(group)
        given = given[1:]
    return tyro.extras.subcommand_cli_from_dict(
        {name: _with_checked_numbers(_with_joined_lines(verb)) for name, verb in known.items()},
        prog=prog,
        description=description,
        args=given,
        config=(tyro.conf.FlagCreatePairsOff,),
    )


def _with_axes_joined(given: list[str]) -> list[str]:
    """`--up -y` as `--up=-y`: a value that begins with a dash would pass for an option."""
    words: list[str] = []
    for word in given:
        if words and words[-1] == "--up" and word in ("-x", "-y", "-z"):
            words[-1] = f"--up={word}"
        else:
            words.append(word)
    return words


def _show_verbs() -> None:
    from nrdf.commands.console import show, table

    shown = table("", "", "")
    for name, verb in verbs().items():
        shown.add_row(f"  {name}", (verb.__doc__ or "").partition("\n")[0])
    _say(USAGE)
    show(shown)
    _say(NOTES)


def _say(what: Any) -> None:
    from nrdf.commands.console import console

    console.print(what)


def _with_joined_lines(verb: Callable[..., Any]) -> Callable[..., Any]:
    """The verb, its docstring's arguments on one line each: tyro would keep the line breaks."""
    verb.__doc__ = re.sub(r"\n {12}", " ", verb.__doc__ or "")
    return verb


def _with_checked_numbers(verb: Callable[..., Any]) -> Callable[..., Any]:
    """The verb, called only with numbers that are within its annotations' bounds."""
    from nrdf.io.bounds import check_numbers

    @functools.wraps(verb)
    def checked(*given: Any, **named: Any) -> Any:
        values = inspect.signature(verb).bind(*given, **named).arguments
        hints = typing.get_type_hints(verb, include_extras=True)
        flags = {name: f"--{name.replace('_', '-')}" for name in values}
        check_numbers(
            {flags[name]: value for name, value in values.items()},
            {flags[name]: hints[name] for name in values},
        )
        return verb(*given, **named)

    return checked


def _complain(message: str) -> None:
    from nrdf.commands.console import errors

    errors.print(f"nrdf: {message}", style="red")


def _configure_logging(verbose: bool) -> None:
    from nrdf.commands.console import LogHandler

    for name in ("nrdf", "nrdf_benchmark"):
        logger = logging.getLogger(name)
        logger.handlers = [LogHandler()]
        logger.setLevel(logging.DEBUG if verbose else logging.INFO)
        logger.propagate = False


if __name__ == "__main__":
    main()
