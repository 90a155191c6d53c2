"""Boxes of different sizes, and a correspondence between them that is known exactly."""

from __future__ import annotations

import numpy as np

from builders.taught_box import SIZE
from nrdf.process.correspondence import ReferenceSurface
from nrdf.regions.mapping import MappedPoints
from nrdf.toolpath.frames import tool_quaternions
from nrdf.toolpath.types import Segment

SCALE = np.array([1.3, 0.8, 1.1])
UP = np.array([0.0, 1.0, 0.0])


def scaled_reference(model, reference, scale):
    """A reference whose points map to `scale` (3,) times their coordinates on every target."""
    encoded = model.set_reference(reference)

    def mapped(points, normals, target):
        there = target.canonical(points * scale)
        count = len(points)
        return MappedPoints(there, normals, np.ones(count), np.zeros(count), np.zeros((count, 3)))

    encoded.map_surface_points = mapped
    encoded.map_points = lambda at, target: mapped(
        reference.points[at], reference.normals[at], target
    )
    return ReferenceSurface(encoded)


def line_on_top(height=0.0, lead=0.0, tilt=0.0, count=12):
    """A line on the top face, from one corner's side to the other's."""
    along = np.linspace(-0.5, 0.5, count)[:, None]
    points = along * [0.2, 0.0, 0.5] + [0.0, SIZE[1] / 2, 0.0]
    travel = np.broadcast_to([0.2, 0.0, 0.5] / np.hypot(0.2, 0.5), points.shape)
    turns = tool_quaternions(travel, np.broadcast_to(UP, points.shape), lead, tilt)
    return Segment("process", 0, points + height * UP, turns, 0.1)
