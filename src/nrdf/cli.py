"""The command line: one verb per command, errors without tracebacks, an exit code for scripts."""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import entry_points
from typing import Any

import nrdf
from nrdf.errors import ConfigError, NrdfError

Verb = Callable[..., Any]

USAGE = """usage: nrdf VERB ... [-v]
Teach a surface process once, on one object; run it on every such object."""
NOTES = """
All options, with an example: nrdf VERB --help. Debug messages: -v; --version.
Exit codes: 0 all well; 1 some shapes not used; 2 bad input. With a result: 3 a
limit not met (--strict: doubtful); 4 nothing found or planned. 130 Ctrl-C."""

GROUPS = ("cell", "model", "eval")
"""Verbs that have verbs of their own: calling one gives them, name to function."""
BENCHMARK = ("eval", "ablate")
"""Verbs that come with `nrdf_benchmark`."""
FOR_MAKERS = ("model", *BENCHMARK)
"""Verbs that stand apart in the help."""
RESUMABLE = (
    "ablate", "run", "serve", "eval bsrc", "eval presence", "model boxes", "model correspond",
    "model general", "model kind", "model learn", "model prepare", "model synth", "model train",
)  # fmt: skip
"""Verbs that go on where they were when the same command is given again."""


def verbs() -> dict[str, Verb]:
    """Name to function; their modules import nothing heavy."""
    from nrdf.commands.align import align
    from nrdf.commands.cell import cell
    from nrdf.commands.check import check
    from nrdf.commands.demo import demo
    from nrdf.commands.export import export
    from nrdf.commands.info import info
    from nrdf.commands.model import model
    from nrdf.commands.profile import profile
    from nrdf.commands.retrieve import retrieve
    from nrdf.commands.run import run as run_line
    from nrdf.commands.serve import serve
    from nrdf.commands.simulate import simulate
    from nrdf.commands.studio import studio
    from nrdf.commands.teach import teach
    from nrdf.commands.transfer import transfer

    own = (
        *(teach, profile, check, transfer, retrieve, align, cell, export, simulate, run_line),
        *(serve, studio, demo, info, model),
    )
    return {**{verb.__name__: verb for verb in own}, **_verbs_of_other_packages()}


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
        return _run(_with_targets_first(_with_axes_joined(given)))
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


def _run(given: list[str]) -> int:
    if given in ([], ["-h"], ["--help"]):
        _show_verbs()
        return 0
    if given == ["--version"]:
        _say(f"nrdf {nrdf.__version__}")
        return 0
    known, prog = verbs(), "nrdf"
    verb, words = _find(given[0], known), given[1:]
    if given[0] in GROUPS:
        prog, group, known = f"nrdf {given[0]}", verb, verb()
        if words in ([], ["-h"], ["--help"]):
            _show_group(prog, group, known)
            return 0
        given = words
        verb, words = _find(given[0], known, prog), given[1:]
    from nrdf.commands.parser import parse

    call = parse(verb, f"{prog} {given[0]}", words)
    return (call() or 0) if call else 0


def _find(word: str, known: Mapping[str, Verb], prog: str = "nrdf") -> Verb:
    """The verb of that name. Raises ConfigError with the nearest for one that is not known."""
    from nrdf.commands.parser import closest

    if word in known:
        return known[word]
    if word in BENCHMARK:
        raise ConfigError(
            f"`nrdf {word}` is part of nrdf_benchmark, which is not installed; "
            "pip install 'nrdf[benchmark]'"
        )
    if prog == "nrdf":
        within = [group for group in GROUPS if group in known and word in known[group]()]
        also = f"; did you mean '{within[0]} {word}'?" if within else closest(word, known)
        raise ConfigError(f"no verb '{word}'{also}\nsee nrdf --help")
    also = closest(word, known) or f"; known: {', '.join(known)}"
    raise ConfigError(f"{prog} has no verb '{word}'{also}\nsee {prog} --help")


def _verbs_of_other_packages() -> dict[str, Verb]:
    """Verbs that installed packages add, as entry points of the group `nrdf.commands`."""
    found: dict[str, Verb] = {}
    for point in entry_points(group="nrdf.commands"):
        try:
            found[point.name] = point.load()
        except ModuleNotFoundError as error:
            # A package that is not there adds nothing; what fails inside one is a fault to see.
            if error.name != point.module.partition(".")[0]:
                raise
    return found


def _resumable(given: list[str]) -> bool:
    # What `nrdf eval` measures is kept only where there is a folder for it.
    kept = given[0] != "eval" or any(word.partition("=")[0] == "--out" for word in given)
    return kept and (given[0] in RESUMABLE or " ".join(given[:2]) in RESUMABLE)


def _with_axes_joined(given: list[str]) -> list[str]:
    """`--up -y` as `--up=-y`: a value that begins with a dash would pass for an option."""
    words: list[str] = []
    for word in given:
        if words and words[-1] == "--up" and word in ("-x", "-y", "-z"):
            words[-1] = f"--up={word}"
        else:
            words.append(word)
    return words


def _with_targets_first(given: list[str]) -> list[str]:
    """`transfer k.yaml --out jobs --target a b` as `transfer k.yaml a b --out jobs`."""
    if given[:1] != ["transfer"] or "--target" not in given:
        return given
    at = given.index("--target")
    end = next((i for i in range(at + 1, len(given)) if given[i].startswith("-")), len(given))
    first = next((i for i in range(1, at) if given[i].startswith("-")), at)
    targets, rest = given[at + 1 : end], given[:at] + given[end:]
    return [*rest[:first], *targets, *rest[first:]]


def _show_verbs() -> None:
    known = verbs()
    for_makers = [name for name in FOR_MAKERS if name in known]
    _say(USAGE)
    for name in [name for name in known if name not in for_makers]:
        _say(f"  {name:9} {_first_line(known[name])}")
    _say("")
    for name in for_makers:
        _say(f"  {name:9} {_first_line(known[name])}")
    _say(NOTES)


def _show_group(prog: str, group: Verb, known: Mapping[str, Verb]) -> None:
    _say(f"usage: {prog} VERB ...\n\n{_first_line(group)}\n")
    width = max(map(len, known))
    for name, verb in known.items():
        _say(f"  {name:{width}}  {_first_line(verb)}")
    _say(f"\nAn example and all options: {prog} VERB --help.")


def _first_line(verb: Verb) -> str:
    return (verb.__doc__ or "").partition("\n")[0]


def _say(what: Any) -> None:
    from nrdf.commands.console import console

    console.print(what)


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
