"""Clouds of simple surfaces with their true normals, made with a random generator."""

from __future__ import annotations

import numpy as np


def sphere(rng, count, radius=0.5):
    normals = rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return radius * normals, normals


def box(rng, count, sides):
    """Points and normals on the surface of a box, evenly over its area."""
    sides = np.asarray(sides, float)
    area = np.array([sides[1] * sides[2], sides[0] * sides[2], sides[0] * sides[1]])
    axis = rng.choice(3, count, p=area / area.sum())
    points = (rng.random((count, 3)) - 0.5) * sides
    sign = rng.choice([-1.0, 1.0], count)
    normals = np.zeros((count, 3))
    normals[np.arange(count), axis] = sign
    points[np.arange(count), axis] = sign * sides[axis] / 2
    return points, normals


def bent_shell(rng, count, thickness=0.022):
    """A third of a tube's wall, open at both ends: a bent chair back."""
    outside = rng.random(count) < 0.5
    angle = rng.uniform(-1.0, 1.0, count)
    radius = np.where(outside, 0.5, 0.5 - thickness)
    radial = np.stack([np.cos(angle), np.zeros(count), np.sin(angle)], axis=1)
    points = radius[:, None] * radial + rng.uniform(-0.5, 0.5, (count, 1)) * [0.0, 1.0, 0.0]
    return points, np.where(outside[:, None], radial, -radial)
