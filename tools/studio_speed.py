"""Measure what docs/studio.md says about speed, on the bundled chairs.

    python tools/studio_speed.py

Processor time of this program, in seconds; what the browser takes to draw comes on top.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable

import numpy as np

import nrdf
from nrdf.bundled import REFERENCE as CHAIR
from nrdf.bundled import TARGETS, bundled_chair
from nrdf.studio.drawing import colours_of
from nrdf.studio.editor import Desk
from nrdf.studio.paintable_cloud import REFERENCE
from nrdf.studio.result_cache import Bench
from nrdf.studio.session import Session
from nrdf.studio.uploads import bundled

TIMES = 5


def took(work: Callable[[], object], times: int = TIMES) -> float:
    """The shortest processor time of several runs."""
    spent = []
    for _ in range(times):
        start = time.process_time()
        work()
        spent.append(time.process_time() - start)
    return min(spent)


def main() -> None:
    """Print a line for each figure."""
    truth = bundled_chair(CHAIR)[1]
    with tempfile.TemporaryDirectory() as folder:
        desk = Desk(Session(folder))
        desk.open_reference(CHAIR, bundled(CHAIR), "chair")
        for name, kind in (("seat", "sand"), ("back-front", "polish")):
            desk.add_region(name)
            desk.paint(REFERENCE, name, truth[name])
            desk.restart_step(name, 0, kind)
        desk.add_target(TARGETS[0], bundled(TARGETS[0]))
        bench = Bench(desk, nrdf.load_model)
        body = desk.body(REFERENCE)
        middle = int(np.flatnonzero(truth["seat"])[0])

        def grow() -> None:
            desk.paint(REFERENCE, "seat", truth["seat"] | body.canvas.patch(middle, 0.2))
            colours_of(desk, bench, REFERENCE)

        def plan() -> None:
            bench.make_plans(desk.document, silent)

        grow()
        print(f"a click of Grow, 0.2 m, its colours and the saved session: {took(grow):.4f} s")
        desk.paint(REFERENCE, "seat", truth["seat"])
        print(f"plans on a seat and a backrest: {took(plan, 1):.2f} s")
        bench.model("chair")
        document = desk.document
        spent = took(lambda: bench.transfer(document, silent), 1)
        print(f"both on {TARGETS[0]}, regions and tool paths: {spent:.2f} s")
        spent = took(lambda: bench.described(document, silent), 1)
        described = bench.described(document, silent)
        print(f"likeness, the first place on two objects: {spent:.2f} s")
        spent = took(lambda: described.unlike(middle))
        print(f"likeness, each place that the cursor goes on to: {spent:.4f} s")


def silent(done: int, total: int) -> None:
    """Progress that nobody looks at."""


if __name__ == "__main__":
    main()
