"""Members of families as points, and a stand-in for a network that tells the kind of object."""

from __future__ import annotations

from functools import cache

import numpy as np

from nrdf.field.kind_network import CLASSES
from nrdf.shapes.families import get_family


@cache
def member(category: str, seed: int = 1_000_003) -> np.ndarray:
    surface = get_family(category).member(seed).sample_surface(6000, np.random.default_rng(0))
    return np.asarray(surface.points)


class Saying:
    """A network that answers one thing."""

    def __init__(self, answer: int, sure: float = 0.9) -> None:
        self.told = np.full(CLASSES, (1 - sure) / (CLASSES - 1))
        self.told[answer] = sure

    def probabilities(self, points):
        return self.told
