"""YAML and JSON that people, or strangers, write."""

from __future__ import annotations

import math
import re
import time

import pytest
import yaml

from nrdf.io import yaml_json
from nrdf.io.yaml_json import MAX_DEPTH, read_json, read_yaml, to_yaml_line
from nrdf.training.config import CONFIG_FOLDER

LEVELS = list(zip("abcdefgh", "bcdefghi", strict=True))
LAUGHS = "a: &a [1, 1, 1, 1, 1, 1, 1, 1, 1]\n" + "".join(
    f"{name}: &{name} [{', '.join(['*' + before] * 9)}]\n" for before, name in LEVELS
)
MERGES = "a: &a {x: 1}\n" + "".join(
    f"{name}: &{name}\n  <<: [{', '.join(['*' + before] * 9)}]\n" for before, name in LEVELS
)


@pytest.mark.parametrize("path", sorted(CONFIG_FOLDER.glob("*.yaml")), ids=lambda path: path.stem)
def test_plain_files_mean_what_yaml_says(path):
    text = path.read_text()
    assert read_yaml(text) == yaml.safe_load(text)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e-3", 0.001), ("-.5", -0.5), ("1_000", 1000), ("+7", 7), (".inf", math.inf),
        ("0x10", "0x10"), ("010", "010"), ("1:30", "1:30"), ("2020-01-01", "2020-01-01"),
        ("~", None), ("", None), ("Yes", True), ("off", False), ("'1'", "1"), ('"~"', "~"),
        ("|\n  a\n  b", "a\nb"), ("[1, [a], {b: c}]", [1, ["a"], {"b": "c"}]), ("1.5.2", "1.5.2"),
        ("{1: a, yes: b, ~: c}", {"1": "a", "yes": "b", "~": "c"}), ("-", [None]), ("--", "--"),
    ],
)  # fmt: skip
def test_scalars_without_traps(text, value):
    assert read_yaml(text) == value and type(read_yaml(text)) is type(value)


def test_aliases_and_merges():
    text = "{a: &a {p: 1, q: 2}, b: {<<: *a, q: 3}, c: {<<: [{p: 9}, *a], r: 4}, d: [*a]}"
    found = read_yaml(text)
    assert found["b"] == {"p": 1, "q": 3} and found["c"] == {"p": 9, "q": 2, "r": 4}
    assert found["d"] == [{"p": 1, "q": 2}]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[" * 1_000_000, f"line 1: mappings and lists are nested more than {MAX_DEPTH} deep"),
        ("- " * 100_000, "nested more than"),
        ("{a: " * 100_000, "nested more than"),
        (LAUGHS, "more than 5,000,000 values, aliases included"),
        (MERGES, "more than 5,000,000 values, aliases included"),
        ("a: 1\nb: !!bool foo", "line 2: the tag !!bool is not understood"),
        ("!!int ''", "the tag !!int"),
        ("a: !!timestamp foo", "the tag !!timestamp"),
        ("!!python/object/apply:os.getcwd []", "the tag !!python/object/apply:os.getcwd"),
        ("!mine {a: 1}", "the tag !mine"),
        ("9" * 5000, "line 1: a number of 5000 digits; 100 are the most"),
        ("0." + "1" * 5000, "a number of 5002 digits"),
        ("a: &a [*a]", "the alias *a stands within its own anchor &a"),
        ("a: *b", "no anchor &b stands before *b"),
        ("a: 1\na: 2", "the key 'a' occurs twice, again in line 2"),
        ("--- 1\n--- 2", "a second document begins"),
        ("<<: 3", "<< needs a mapping"),
        ("? [1]\n: 2", "a key must be text"),
        ("{&a [1]: 2}", "a key must be text"),
        ("a: &a {b: 1}\n? *a\n: 2", "a key must be text"),
        ("a: \0", "control characters"),
    ],
)  # fmt: skip
def test_hostile_yaml_is_refused_at_once(text, message):
    start = time.perf_counter()
    with pytest.raises(ValueError, match=re.escape(message)):
        read_yaml(text)
    assert time.perf_counter() - start < 2.0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[" * 1_000_000, "nested more than"),
        ("[" * 51 + "]" * 51, "nested more than"),
        ('{"a": 1, "a": 2}', "the key 'a' occurs twice"),
        ("9" * 5000, "a number of 5000 digits"),
        ("NaN", "NaN is no number"),
        ("-Infinity", "-Infinity is no number"),
        ('{"a": 1', "delimiter"),
    ],
)
def test_hostile_json_is_refused(text, message):
    with pytest.raises(ValueError, match=message):
        read_json(text)


def test_what_is_too_much_is_refused(monkeypatch):
    monkeypatch.setattr(yaml_json, "MAX_VALUES", 5)
    monkeypatch.setattr(yaml_json, "MAX_KEYS", 2)
    for read, many, keys in (
        (read_yaml, "[1, 2, 3, 4, 5, 6]", "{a: {b: {c: 1}}}"),
        (read_json, "[1, 2, 3, 4, 5, 6, 7]", '{"a": {"b": {"c": 1}}}'),
    ):
        for text in (many, keys):
            with pytest.raises(ValueError, match="more than"):
                read(text)


TEXTS = (
    "1e5", "1.5e3", "0x10", "010", "1:30", "2020-01-01", "yes", "~", "", " ", "a: b", "# a", "- a",
    "a\nb", "a\n\n b\n", "\t", "\u2028", "\x85", "\ufeff", "é", "'", '"', "*a", "&a", "!a", "%",
    "@", "a" * 500, "[", "{", "<<", "=", ".inf", "null", "...", "---", "? a", "a #b", "\U0001f600",
)  # fmt: skip


@pytest.mark.parametrize("value", TEXTS)
def test_text_on_one_line_is_read_as_the_same(value):
    for plain in (value, [value, {"key": value}], {"x": {"y": [value]}}):
        line = to_yaml_line(plain)
        assert len(line.splitlines()) <= 1 and read_yaml(f"a: {line}\nb: 1") == {"a": plain, "b": 1}


def test_values_on_one_line_are_read_as_the_same():
    value = {"a": [1, 2.5, 1e-7, 1e30, -0.0, True, None, {}, []], "b": {"c": 10**50}}
    assert read_yaml(to_yaml_line(value)) == value
    same = [1]
    assert "*" not in to_yaml_line([same, same])
