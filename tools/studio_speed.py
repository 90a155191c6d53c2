"""Measure what docs/guides/studio.md says about speed, on the bundled chairs.

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
from nrdf.studio.model.computing import LocalComputing
from nrdf.studio.model.document import REFERENCE
from nrdf.studio.model.editor import Editor
from nrdf.studio.model.result_cache import ResultCache
from nrdf.studio.model.session import Session
from nrdf.studio.model.uploads import bundled
from nrdf.studio.scene.drawing import colours_of

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
    """Print a line for each measurement."""
    truth = bundled_chair(CHAIR)[1]
    model = nrdf.load_model("chair")
    with tempfile.TemporaryDirectory() as folder:
        editor = Editor(Session(folder))
        editor.open_reference(CHAIR, bundled(CHAIR), "chair")
        for name, kind in (("seat", "sand"), ("back-front", "polish")):
            editor.add_region(name)
            editor.paint(REFERENCE, name, truth[name])
            editor.restart_step(name, 0, kind)
        editor.add_target(TARGETS[0], bundled(TARGETS[0]))
        results = ResultCache(editor, LocalComputing(lambda category: model))
        cloud = editor.paintable(REFERENCE)
        middle = int(np.flatnonzero(truth["seat"])[0])

        def grow() -> None:
            editor.paint(REFERENCE, "seat", truth["seat"] | cloud.canvas.patch(middle, 0.2))
            colours_of(editor, results, REFERENCE)

        def plan() -> None:
            results.make_plans(editor.document, silent)

        grow()
        print(f"a click of Grow, 0.2 m, its colours and the saved session: {took(grow):.4f} s")
        editor.paint(REFERENCE, "seat", truth["seat"])
        print(f"plans on a seat and a backrest: {took(plan, 1):.2f} s")
        editor.change_numbers("seat", 0, {"stepover_mm": 22.0})
        print(f"the seat's plan again, after a number was changed: {took(plan, 1):.2f} s")
        document = editor.document
        spent = took(lambda: results.transfer(document, silent), 1)
        print(f"both on {TARGETS[0]}, regions and tool paths: {spent:.2f} s")
        spent = took(lambda: results.correspondence_features(document, silent), 1)
        features = results.correspondence_features(document, silent)
        print(f"similarity, the first point on two objects: {spent:.2f} s")
        spent = took(lambda: features.distances(middle))
        print(f"similarity, each point after it: {spent:.4f} s")


def silent(done: int, total: int) -> None:
    """Ignores progress."""


if __name__ == "__main__":
    main()
