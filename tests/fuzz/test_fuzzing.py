"""The fuzz frame itself: it must notice what it is there for."""

from __future__ import annotations

import re
import sys
import time

import numpy as np
import pytest
from hypothesis import Phase, find, given, settings

from builders.fuzzing import altered, damaged, message_of, outcome_of, tries
from nrdf.errors import CloudError


def test_a_result_and_an_error_of_ours_are_outcomes():
    assert outcome_of(lambda: 3) == 3
    error = CloudError("too small")

    def refuse():
        raise error

    assert outcome_of(refuse) is error and message_of(refuse) == "too small"
    with pytest.raises(AssertionError, match="read as 3"):
        message_of(lambda: 3)


@pytest.mark.parametrize("error", [ValueError, MemoryError, KeyError, RecursionError])
def test_another_error_fails(error):
    def stumble():
        raise error("x")

    with pytest.raises(error):
        outcome_of(stumble)


def test_an_empty_message_fails():
    def mumble():
        raise CloudError(" ")

    with pytest.raises(AssertionError, match="without a message"):
        outcome_of(mumble)


def test_a_hang_fails():
    start = time.monotonic()
    with pytest.raises(AssertionError, match="still busy"):
        outcome_of(lambda: time.sleep(5), seconds=0.1)
    assert time.monotonic() - start < 4


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="measured on Linux only")
def test_memory_that_was_taken_for_a_moment_fails():
    with pytest.raises(AssertionError, match=r"took 0\.2"):
        outcome_of(lambda: len(np.ones(25_000_000)), memory=100_000_000)
    with pytest.raises(MemoryError):
        outcome_of(lambda: len(np.ones(25_000_000)), memory=10_000_000)
    assert outcome_of(lambda: len(np.ones(1_000_000)), memory=100_000_000) == 1_000_000


SEARCH = settings(max_examples=5000, derandomize=True, phases=[Phase.generate])
CONTENT = b"ply\nelement vertex 4\nend_header\n1 2 3\n4 5 6\n7 8 9\n1 1 2\n"


@pytest.mark.parametrize(
    "sign",
    [
        lambda found: found == CONTENT[:10],
        lambda found: len(found) > len(CONTENT) + 8,
        lambda found: re.search(rb"vertex \d{9,}\n", found),
        lambda found: b"\xff\xff\xff\xff" in found,
        lambda found: b"end_header" not in found and len(found) > 40,
    ],
)
def test_damage_of_every_kind_comes_up(sign):
    find(damaged(CONTENT), sign, settings=SEARCH)


TREE = {"name": "a", "steps": [{"speed": 0.1}, {"speed": 0.2}]}


@pytest.mark.parametrize(
    "sign",
    [
        lambda found: len(found["steps"]) == 3,
        lambda found: "name" not in found,
        lambda found: found["steps"][1]["speed"] == "nan",
        lambda found: found["steps"] == {},
        lambda found: len(found) == 3,
    ],
)
def test_alterations_of_every_kind_come_up(sign):
    def shows(found):
        try:
            return sign(found)
        except (KeyError, TypeError, IndexError):
            return False

    find(altered(TREE), shows, settings=SEARCH)


@tries(20)
@given(altered(TREE))
def test_what_is_altered_is_a_copy(_):
    assert TREE == {"name": "a", "steps": [{"speed": 0.1}, {"speed": 0.2}]}
