"""Inside or outside of a mesh, and the places where training asks for it."""

from __future__ import annotations

import numpy as np

from nrdf.geometry.winding import mesh_winding_numbers

PADDING = 0.1
"""Share of the longest side by which the box of uniform queries is larger (Mescheder 2019)."""
NEAR = (0.005, 0.02, 0.05)
"""Standard deviations of the queries near the surface, canonical; drawn with equal chance."""


def inside(vertices: np.ndarray, faces: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Whether each of `points` (n, 3) is inside the mesh of outward `faces`: (n,) bool.

    The winding number is above one half, so parts may overlap and small holes do no harm. A sheet
    without thickness has no inside.
    """
    return mesh_winding_numbers(vertices, faces, points) > 0.5


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
