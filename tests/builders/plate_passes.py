"""Straight passes over a plate and a cylinder along y, for closed forms of film and depth."""

from __future__ import annotations

import numpy as np

from nrdf.process_model.cells import plate
from nrdf.surface.target_mesh import TargetMesh
from nrdf.toolpath.types import Segment

FEED = 0.25


def passes(offsets, length=0.5, height=0.2, spacing=0.01):
    """Straight passes along y over z = 0, tool x along y, tool z down."""
    y = np.linspace(-0.5, 0.5, round(length / spacing) + 1) * length
    half = np.sqrt(0.5)
    held = np.tile([half, half, 0.0, 0.0], (len(y), 1))
    return [
        Segment("process", k, np.stack([0 * y + x, y, 0 * y + height], 1), held, FEED)
        for k, x in enumerate(offsets)
    ]


def cylinder(radius, angle, length, edge):
    """A cylinder along y, up to `angle` to either side of its top in z = 0."""
    flat = plate(2.0 * angle * radius, length, edge)
    turn = flat.vertices[:, 0] / radius
    vertices = np.stack(
        [radius * np.sin(turn), flat.vertices[:, 1], radius * (np.cos(turn) - 1.0)], axis=1
    )
    return TargetMesh(vertices, flat.faces)
