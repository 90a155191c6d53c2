"""Numbers that people give: none that is not finite, none out of its bounds, in any verb."""

from __future__ import annotations

import inspect
import typing
from typing import Annotated

import pytest

from nrdf import cli
from nrdf.commands.parser import checked_call
from nrdf.errors import ConfigError
from nrdf.io.bounds import FINITE, FRACTION, Bounds, Count, Fraction, Seed, check_numbers
from nrdf.process.limits import Limits

NAN, INF = float("nan"), float("inf")


def every_verb():
    """Every verb of the command line by its words, those of groups too."""
    for name, verb in cli.verbs().items():
        if name in cli.GROUPS:
            yield from ((f"{name} {inner}", of) for inner, of in verb().items())
        else:
            yield name, verb


def numeric(kind):
    """(verb, argument, whether it takes several) of every argument that takes numbers of a kind."""
    found = []
    for words, verb in every_verb():
        for name, hint in typing.get_type_hints(verb).items():
            if name != "return" and kind in {hint, *typing.get_args(hint)}:
                several = typing.get_origin(hint) is tuple
                found.append(pytest.param(verb, name, several, id=f"{words} --{name}"))
    return found


def call(verb, **given):
    """Call a verb as the command line does, with None for what else it needs."""
    parameters = inspect.signature(verb).parameters.items()
    needed = {name: None for name, p in parameters if p.default is inspect.Parameter.empty}
    checked_call(verb, {**needed, **given})


@pytest.mark.parametrize("value", [NAN, INF, -INF])
@pytest.mark.parametrize(("verb", "name", "several"), numeric(float))
def test_no_verb_takes_a_number_that_is_not_finite(verb, name, several, value):
    given = (1.0, value, 1.0) if several else value
    with pytest.raises(ConfigError, match=f"--{name.replace('_', '-')} {value:g} must be "):
        call(verb, **{name: given})


@pytest.mark.parametrize(("verb", "name", "several"), numeric(int))
def test_no_verb_takes_a_count_below_0(verb, name, several):
    with pytest.raises(ConfigError, match=f"--{name.replace('_', '-')} -1 must be "):
        call(verb, **{name: (1, -1) if several else -1})


def test_the_walk_over_the_verbs_finds_what_it_is_for():
    found = {param.id for param in (*numeric(float), *numeric(int))}
    assert {"transfer --min_coverage", "transfer --sensor", "model scan --noise"} <= found
    assert {"model scan --views", "eval bsrc --workers", "simulate --shift_mm"} <= found


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("--min-coverage nan", "--min-coverage nan must be from 0 to 1"),
        ("--min-confidence 1.5", "--min-confidence 1.5 must be from 0 to 1"),
        ("--min-coverage -0.1", "--min-coverage -0.1 must be from 0 to 1"),
        ("--max-axis-error-deg inf", "--max-axis-error-deg inf must be from 0 to 180"),
        ("--max-cycle-time-s=-1", "--max-cycle-time-s -1 must be 0 or more"),
        ("--up z --sensor 0 nan 1", "--sensor nan must be a finite number"),
    ],
)
def test_a_limit_that_never_breaks_ends_with_2(tmp_path, capsys, words, message):
    given = f"transfer k.yaml t.ply --out {tmp_path}/job {words}"
    assert cli.run(given.split()) == 2
    assert message in capsys.readouterr().err


def test_limits_in_python_are_checked_too():
    for wrong in ({"min_coverage": NAN}, {"min_coverage": 1.01}, {"max_cycle_time_s": -1.0}):
        with pytest.raises(ConfigError, match=f"{next(iter(wrong))} .* must be "):
            Limits(**wrong)


@pytest.mark.parametrize(
    ("bounds", "good", "bad", "words"),
    [
        (FINITE, (-1e300, 0, 10**400), (NAN, INF), "a finite number"),
        (FRACTION, (0, 0.5, 1), (-1e-9, 1.1, NAN), "from 0 to 1"),
        (Bounds(0.0), (0, 5), (-1, INF), "0 or more"),
        (Bounds(0.0, above=True), (1e-9,), (0, -(10**400)), "above 0"),
        (Bounds(0.0, 2.0, above=True), (2,), (0, 3), "above 0 to 2"),
    ],
)
def test_bounds(bounds, good, bad, words):
    for value in good:
        bounds.check("it", value)
    for value in bad:
        with pytest.raises(ConfigError, match=f"^it .* must be {words}$"):
            bounds.check("it", value)


def test_bounds_are_found_within_annotations():
    hints = {"share": Fraction | None, "pair": tuple[Annotated[float, Bounds(0.0)], float]}
    check_numbers({"share": None, "pair": (1.0, 2.0), "flag": True, "name": "nan"}, hints)
    for wrong in ({"share": 2.0}, {"pair": (1.0, -1.0)}, {"unknown": NAN}, {"unknown": -1}):
        with pytest.raises(ConfigError):
            check_numbers(wrong, hints)
    for count, hint in ((0, Count), (-1, Seed)):
        with pytest.raises(ConfigError):
            check_numbers({"count": count}, {"count": hint})
