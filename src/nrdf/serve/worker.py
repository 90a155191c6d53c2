"""A worker process: objects come in as lines of JSON, judgements go out.

    python -m nrdf.serve.worker CELL_FILE

It ends with the process that started it, whatever that dies of.
"""

from __future__ import annotations

import json
import logging
import os
import sys
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any, TextIO

from nrdf.errors import NrdfError
from nrdf.serve.store import ObjectRow

_LOOK_S = 0.5
READY = {"ready": True}


def main(arguments: list[str]) -> int:
    """Serve objects until there are no more."""
    answers = _answers()
    from nrdf.serve.work import ObjectWork

    logging.getLogger("nrdf").addHandler(logging.NullHandler())
    try:
        work = ObjectWork.of(Path(arguments[0]))
    except NrdfError as error:
        _say(answers, {"failed": str(error)})
        return 2
    serve(sys.stdin, answers, lambda row, place: asdict(work.judge(row, place)))
    return 0


def serve_parent(judge: Callable[[ObjectRow, Path], Mapping[str, Any]]) -> None:
    """Answer the tasks of the process that started this one by a judge of another kind."""
    serve(sys.stdin, _answers(), judge)


def serve(
    tasks: TextIO, answers: TextIO, judge: Callable[[ObjectRow, Path], Mapping[str, Any]]
) -> None:
    """Be ready, and answer every task, a line each, until they end."""
    with suppress(BrokenPipeError):  # the line has gone; so does this
        _say(answers, READY)
        for line in tasks:
            task = json.loads(line)
            said = judge(ObjectRow(**task["row"]), Path(task["work"]))
            _say(answers, {"id": task["row"]["id"], **said})


def _answers() -> TextIO:
    """Where answers go, of a process that ends with its parent.

    Libraries that print would break the protocol: what they say goes to standard error.
    """
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    _end_with_parent()
    return answers


def _say(answers: TextIO, content: Mapping[str, Any]) -> None:
    answers.write(json.dumps(content) + "\n")
    answers.flush()


def _end_with_parent() -> None:
    """End this process soon after its parent has: what it works on is begun again by another."""
    parent = os.getppid()

    def look() -> None:
        while os.getppid() == parent:
            time.sleep(_LOOK_S)
        os._exit(1)

    threading.Thread(target=look, daemon=True).start()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
