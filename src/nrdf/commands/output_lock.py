"""Only one run at a time writes to a place."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from contextlib import ExitStack
from functools import wraps
from pathlib import Path
from typing import ParamSpec, TypeVar

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


def lock_output(name: str) -> Callable[[Callable[Arguments, Result]], Callable[Arguments, Result]]:
    """A decorator: the verb keeps other runs out of the place that its argument `name` gives.

    The argument may also give several places, or None. OutputError is raised at once, before
    anything is computed, if another run writes there or it cannot be written
    (`nrdf.io.locks.write_lock`).
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
