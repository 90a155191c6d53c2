"""A chair of overlapping boxes, and what is inside it."""

from __future__ import annotations

import numpy as np
import trimesh


def chair() -> trimesh.Trimesh:
    """Overlapping boxes: a seat, a back and four legs; the legs and the back enter the seat."""
    boxes = [((0.5, 0.06, 0.5), (0.0, 0.0, 0.0)), ((0.03, 0.6, 0.5), (-0.235, 0.3, 0.0))]
    boxes += [((0.05, 0.45, 0.05), (x, -0.225, z)) for x in (-0.2, 0.2) for z in (-0.2, 0.2)]
    parts = []
    for sides, centre in boxes:
        part = trimesh.creation.box(sides).subdivide().subdivide()
        parts.append(part.apply_translation(centre))
    return trimesh.util.concatenate(parts)


def inside_chair(points):
    inside_any = np.zeros(len(points), bool)
    for part in chair().split(only_watertight=False):
        low, high = part.bounds
        inside_any |= ((points > low) & (points < high)).all(axis=1)
    return inside_any
