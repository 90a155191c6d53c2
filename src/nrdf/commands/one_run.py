"""Verbs that write to a place over a long time: one run at a time."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from contextlib import ExitStack
from functools import wraps
from pathlib import Path
from typing import ParamSpec, TypeVar

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


def one_run_at(name: str) -> Callable[[Callable[Arguments, Result]], Callable[Arguments, Result]]:
    """A decorator: where the argument `name` gives a place, or several, no other run writes there.

    A second one is refused at once, before anything is computed, and so is a place that cannot be
    written (`nrdf.io.locks.write_lock`).
    """

    def decorate(verb: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
        signature = inspect.signature(verb)

        @wraps(verb)
        def alone(*values: Arguments.args, **named: Arguments.kwargs) -> Result:
            from nrdf.io.locks import write_lock

            bound = signature.bind(*values, **named)
            bound.apply_defaults()
            given = bound.arguments[name]
            places = {given} if isinstance(given, (str, Path)) else set(given or ())
            with ExitStack() as stack:
                for place in sorted(places):
                    stack.enter_context(write_lock(place))
                return verb(*values, **named)

        return alone

    return decorate
