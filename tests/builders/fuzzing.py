"""What every fuzz test needs: how often to try, damaged files, and what may come of them.

A test takes `@tries(n)` for its share of `make test`; `make fuzz` multiplies it. Its inputs come
from `damaged` (bytes of a valid file) or `altered` (what a JSON or YAML file holds), and it hands
the reading of them to `outcome_of`, which fails for everything but a result and an NrdfError.
"""

from __future__ import annotations

import copy
import re
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import hypothesis.strategies as st
from hypothesis import HealthCheck, settings

from nrdf.errors import NrdfError

SECONDS = 60.0
"""What one input may take, on a machine that does much else; a reader that is still at it hangs."""
MEMORY = 1_000_000_000
"""Bytes that one input may take beyond what the process has."""
THOROUGH = settings.get_profile("default").max_examples * 10
settings.register_profile(
    "fuzz", max_examples=THOROUGH, deadline=None, print_blob=True, report_multiple_bugs=True
)


def tries(count: int) -> Callable[[Any], Any]:
    """Settings of a fuzz test: `count` inputs, the same ones in every `make test`; with the
    profile "fuzz" (`make fuzz`) ten times as many, new ones in every round."""
    thorough = settings().max_examples == THOROUGH
    return settings(
        max_examples=10 * count if thorough else count,
        derandomize=not thorough,
        deadline=None,
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
    )


def outcome_of(call: Callable[[], Any], seconds: float = SECONDS, memory: int = MEMORY) -> Any:
    """What `call` gives, or the NrdfError that it raises.

    Whatever else it raises passes through and fails the test; so does taking longer than `seconds`
    or more than `memory` bytes (where the system can tell).
    """
    with _in_time(seconds), _in_memory(memory):
        try:
            return call()
        except NrdfError as error:
            assert str(error).strip(), "an error without a message"
            assert "Traceback" not in str(error)
            return error


def message_of(call: Callable[[], Any]) -> str:
    """The message of the NrdfError that `call` must raise."""
    outcome = outcome_of(call)
    assert isinstance(outcome, NrdfError), f"not refused, but read as {outcome!r:.300}"
    return str(outcome)


NUMBERS = (
    "0", "-1", "1", "2", "3", "7", "255", "256", "65536", "2147483647", "2147483648",
    "4294967295", "4294967296", "9223372036854775807", "18446744073709551616", "9" * 30,
    "9" * 5000, "1e9", "1e30", "1e160", "1e-160", "1e300", "1e-320", "1e999", "-1e300", "nan",
    "inf", "-inf", "-0", "0.5", "1.", ".", "0x10", "1_000", "٣", "1,5", "",
)  # fmt: skip
"""Numbers, and what is nearly one, that readers have stumbled over."""
WORDS = (
    "", " ", "\n", "\0", "#", "/", "..", "-", "~", "*", "'", '"', "{", "[", "x", "é", "\ufeff",
    "a" * 300, "null", "true", "list", "float", "int", "end_header", "/dev/null", "../x", "CON",
)  # fmt: skip

_NUMBER = re.compile(rb"[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
_WORD = re.compile(rb"[A-Za-z_]{2,}")


@st.composite
def damaged(draw: st.DrawFn, content: bytes) -> bytes:
    """`content` damaged in one to four places: cut short, bytes flipped, put in or lost, chunks
    swapped or repeated, and numbers and words of the text in it replaced by awkward ones."""
    for _ in range(draw(st.integers(1, 4))):
        content = draw(_WAYS)(draw, content)
    return content


def _cut(draw: st.DrawFn, content: bytes) -> bytes:
    return content[: draw(_place(content))]


def _flip(draw: st.DrawFn, content: bytes) -> bytes:
    place = draw(_place(content))
    flipped = bytes(b ^ (1 << draw(st.integers(0, 7))) for b in content[place : place + 1])
    return content[:place] + flipped + content[place + 1 :]


def _overwrite(draw: st.DrawFn, content: bytes) -> bytes:
    place = draw(_place(content))
    put = draw(st.one_of(st.binary(max_size=8), st.sampled_from(_RUNS)))
    return content[:place] + put + content[place + len(put) :]


def _insert(draw: st.DrawFn, content: bytes) -> bytes:
    place = draw(_place(content))
    put = draw(st.one_of(st.binary(max_size=8), st.sampled_from(WORDS).map(str.encode)))
    return content[:place] + put + content[place:]


def _lose(draw: st.DrawFn, content: bytes) -> bytes:
    start, end = sorted((draw(_place(content)), draw(_place(content))))
    return content[:start] + content[end:]


def _swap(draw: st.DrawFn, content: bytes) -> bytes:
    a, b, c = sorted(draw(_place(content)) for _ in range(3))
    return content[:a] + content[b:c] + content[a:b] + content[c:]


def _repeat(draw: st.DrawFn, content: bytes) -> bytes:
    start, end = sorted((draw(_place(content)), draw(_place(content))))
    return content[:end] + content[start:]


def _number(draw: st.DrawFn, content: bytes) -> bytes:
    return _replace(draw, content, _NUMBER, NUMBERS)


def _word(draw: st.DrawFn, content: bytes) -> bytes:
    return _replace(draw, content, _WORD, WORDS)


def _replace(
    draw: st.DrawFn, content: bytes, pattern: re.Pattern[bytes], by: tuple[str, ...]
) -> bytes:
    found = [match.span() for match in pattern.finditer(content[:4096])]
    if not found:
        return content
    start, end = draw(st.sampled_from(found))
    return content[:start] + draw(st.sampled_from(by)).encode() + content[end:]


def _place(content: bytes) -> st.SearchStrategy[int]:
    return st.integers(0, len(content))


_RUNS = tuple(bytes([value]) * count for value in (0x00, 0x7F, 0x80, 0xFF) for count in (4, 8, 64))
_WAYS = st.sampled_from(
    [_cut, _flip, _flip, _overwrite, _insert, _lose, _swap, _repeat, _number, _number, _word]
)

HOSTILE: tuple[Any, ...] = (
    None, True, False, 0, -1, 1, 0.5, -0.0, 1e-9, 1e-320, 1e30, 1e160, 1e300, -1e300, 10**30,
    float("nan"), float("inf"), -float("inf"), "", " ", "x", "1", "nan", "..", "/dev/null", "\0",
    "a" * 5000, [], [0], [[]], [1.0, 2.0, 3.0], {}, {"x": 1}, {"": None},
)  # fmt: skip
"""Values that a person or a program may put where another one belongs."""


@st.composite
def altered(draw: st.DrawFn, tree: Any) -> Any:
    """A JSON-like `tree` (mappings, lists, plain values) changed in one to three places: values
    replaced by `HOSTILE` ones, keys lost, renamed or added, list items lost or repeated."""
    tree = copy.deepcopy(tree)
    for _ in range(draw(st.integers(1, 3))):
        places = list(_places(tree))
        if not places:
            break
        holder, key = draw(st.sampled_from(places))
        way = draw(st.sampled_from(["replace", "replace", "replace", "lose", "more"]))
        if way == "replace":
            holder[key] = copy.deepcopy(draw(st.sampled_from(HOSTILE)))
        elif way == "lose":
            del holder[key]
        elif isinstance(holder, list):
            holder.insert(key, copy.deepcopy(holder[key]))
        else:
            holder[draw(st.sampled_from(["", "x", f"{key}_", str(key).upper()]))] = holder[key]
    return tree


def _places(tree: Any) -> Iterator[tuple[Any, Any]]:
    """Every mapping or list in `tree` with each of its keys or positions."""
    if isinstance(tree, (dict, list)):
        for key in list(tree) if isinstance(tree, dict) else range(len(tree)):
            yield tree, key
            yield from _places(tree[key])


@contextmanager
def _in_time(seconds: float) -> Iterator[None]:
    if not hasattr(signal, "setitimer"):
        yield
        return

    def ring(*_: Any) -> None:
        raise AssertionError(f"still busy after {seconds:g} s")

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


@contextmanager
def _in_memory(most: int) -> Iterator[None]:
    """Measures the peak on Linux; there also no more than four times `most` can be had, so that a
    reader that asks for everything does not take the machine down."""
    if not sys.platform.startswith("linux"):
        yield
        return
    import resource

    before = resource.getrlimit(resource.RLIMIT_AS)
    limit = _process_bytes("VmSize") + 4 * most
    if before[1] != resource.RLIM_INFINITY:
        limit = min(limit, before[1])
    Path("/proc/self/clear_refs").write_text("5")  # from here on anew: VmHWM
    start = _process_bytes("VmRSS")
    resource.setrlimit(resource.RLIMIT_AS, (limit, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)
    taken = _process_bytes("VmHWM") - start
    assert taken <= most, f"took {taken / 1e9:.2f} GB"


def _process_bytes(name: str) -> int:
    """Bytes that /proc says of this process."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(name):
            return 1024 * int(line.split()[1])
    raise AssertionError(f"/proc/self/status says no {name}")
