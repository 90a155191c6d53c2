"""What a maker of models needs, one verb per module.

In: meshes, boxes or nothing. Out: training shapes, their correspondences, weights, the model zoo.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def model() -> dict[str, Callable[..., Any]]:
    """Learn your own kind of object; make training shapes, train a model."""
    from nrdf.commands.model.add import add
    from nrdf.commands.model.boxes import boxes
    from nrdf.commands.model.correspond import correspond
    from nrdf.commands.model.general import general
    from nrdf.commands.model.kind import kind
    from nrdf.commands.model.learn import learn
    from nrdf.commands.model.prepare import prepare
    from nrdf.commands.model.scan import scan
    from nrdf.commands.model.synth import synth
    from nrdf.commands.model.train import train

    every = (learn, synth, boxes, prepare, correspond, scan, train, general, kind, add)
    return {verb.__name__: verb for verb in every}
