"""From words to a call: defaults, bounds, help and mistakes."""

from __future__ import annotations

from pathlib import Path

import pytest
from tyro.conf import Positional

from nrdf.commands.options import File
from nrdf.commands.parser import checked_call, closest, flags_of, parse, print_wrapped
from nrdf.errors import ConfigError
from nrdf.io.bounds import Fraction


def sand(
    job: Positional[File],
    min_coverage: Fraction | None = None,
    no_arm: bool = False,
    name: str = "",
):
    """Sand it.

    A paragraph that is longer than one line of a terminal, so that it has to be wrapped somewhere,
    whatever the docstring's own breaks are.

    Args:
        job: A job that is
            described on two lines.
        min_coverage: The least share.
        no_arm: Leave out the arm.
        name: What it is called.
    """
    return job.name, min_coverage, no_arm, name


def test_words_become_a_call_that_is_not_made_yet():
    call = parse(sand, "nrdf sand", ["a/job", "--min-coverage", "0.5", "--no-arm"])
    assert call() == ("job", 0.5, True, "")
    assert parse(sand, "nrdf sand", ["job", "--name=x"])() == ("job", None, False, "x")


def test_help_is_printed_and_nothing_is_called(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert parse(sand, "nrdf sand", ["--help"]) is None
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("usage: nrdf sand [-h]") and " FILE" in lines[0]
    assert max(map(len, lines)) <= 80
    text = " ".join(" ".join(lines).split())
    assert "A job that is described on two lines. (required)" in text
    assert "--min-coverage NUMBER The least share. --no-arm Leave out the arm. --name" in text


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["job", "--min-coverge", "1"], "no option --min-coverge; did you mean '--min-coverage'"),
        (["job", "--min-coverage", "2"], "--min-coverage 2 must be from 0 to 1"),
        (["job", "--min-coverage", "much"], "--min-coverage: could not convert string to float"),
        ([], "Missing from nrdf sand: FILE"),
        (["job", "job"], "Unrecognized options: job"),
    ],
)
def test_mistakes_are_config_errors(words, message):
    with pytest.raises(ConfigError, match="(?s)" + message.replace("(", r"\(")):
        parse(sand, "nrdf sand", words)


def test_numbers_are_checked_before_a_call():
    assert checked_call(sand, {"job": Path("x"), "min_coverage": 1.0})()[1] == 1.0
    with pytest.raises(ConfigError, match="--min-coverage nan must be"):
        checked_call(sand, {"min_coverage": float("nan")})


def test_flags_and_the_closest():
    assert list(flags_of(sand)) == ["--min-coverage", "--no-arm", "--name"]
    assert closest("nane", ["name", "other"]) == "; did you mean 'name'?"
    assert closest("qqqq", ["name"]) == ""


def test_wide_terminals_get_no_wide_lines(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "300")
    print_wrapped("word " * 60 + "\n  indented " + "x" * 150)
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines[:-1])) <= 100 and len(lines[-1]) > 150
