"""Occupancy queries: the places where training asks for inside or outside, and their answers."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from nrdf.errors import DataError

PADDING = 0.1
"""Share of the longest side by which the box of uniform queries is larger (Mescheder 2019)."""
NEAR = (0.005, 0.02, 0.05)
"""Standard deviations of the queries near the surface, canonical; drawn with equal chance."""


def occupancy_queries(surface: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """Queries (count, 3) float16 for a canonical surface (n, 3).

    Half are uniform in the unit cube enlarged by `PADDING`, half near the surface.
    """
    side = 1.0 + PADDING
    uniform = rng.uniform(-side / 2.0, side / 2.0, (count // 2, 3))
    near = count - len(uniform)
    centre = surface[rng.integers(0, len(surface), near)]
    deviation = rng.choice(NEAR, (near, 1))
    return np.concatenate([uniform, centre + deviation * rng.normal(size=(near, 3))]).astype("f2")


def pack_occupancies(occupancies: np.ndarray) -> np.ndarray:
    """Occupancies (q,) bool as bits, eight a byte: (q / 8 rounded up,) uint8."""
    return np.packbits(np.asarray(occupancies, bool))


def unpack_occupancies(path: Path, packed: np.ndarray, count: int) -> np.ndarray:
    """Occupancies (count,) bool from packed bits, or from one value a query as older files have.

    Raises DataError, naming the file `path`, for any other number of values.
    """
    if packed.ndim == 1 and len(packed) == count and packed.dtype.kind in "bf":
        return packed > 0.5
    if packed.dtype == np.uint8 and packed.shape == ((count + 7) // 8,):
        return np.unpackbits(packed, count=count).astype(bool)
    raise DataError(
        f"{path}: {packed.shape} occupancies of {packed.dtype} do not fit {count} queries"
    )
