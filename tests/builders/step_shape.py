"""A block whose front and rear are plain to tell."""

from __future__ import annotations

import numpy as np

from nrdf.shapes.dataset import Shape


def step_shape(name: str, seed: int) -> Shape:
    """A long block with a higher one on its rear half: which end is which is plain to see."""
    rng = np.random.default_rng(seed)
    low, high = np.array([0.5, 0.1, 0.2]), np.array([0.25, 0.15, 0.2])
    points, normals = [], []
    for half, middle in ((low, (0, 0, 0)), (high, (-0.25, 0.25, 0))):
        at = rng.uniform(-1, 1, (2048, 3)) * half
        axis = rng.choice(3, 2048, p=1 / half / (1 / half).sum())
        side = rng.choice([-1.0, 1.0], 2048)
        rows = np.arange(2048)
        at[rows, axis] = side * half[axis]
        line = np.zeros((2048, 3))
        line[rows, axis] = side
        points.append(at + middle)
        normals.append(line)
    queries = np.zeros((8, 3))
    return Shape(name, "step", "blocks", np.vstack(points), np.vstack(normals), queries,
                 np.ones(8, bool))  # fmt: skip


def step_cloud() -> tuple[np.ndarray, np.ndarray]:
    """Points and normals of one, in random order."""
    shape = step_shape("", 0)
    order = np.random.default_rng(0).permutation(4096)
    return shape.surface_points[order], shape.surface_normals[order]
