"""Cells with an arm and a simple object."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import trimesh

from nrdf.geometry.mesh import Mesh
from nrdf.robot.model.cell import Cell, Placement, upright_rotation
from nrdf.robot.model.signed_distance import distance_field_from_points
from nrdf.robot.model.tool import tool_of
from nrdf.robot.planning.inverse_kinematics import SeedLibrary
from nrdf.surface.target_mesh import TargetMesh
from nrdf.toolpath.types import Segment, ToolPath

UP = upright_rotation(*np.eye(3)[[1, 0]])
PLATE_PLACE = Placement((0.75, 0.0, 0.3), np.pi, 0.0, (0.0,))
BOWL_PLACE = Placement((0.8, 0.0, 0.4), np.pi, 0.4, (0.0,))
WALL_PLACE = Placement((0.75, 0.0, 0.3), np.pi, 0.1, (0.0,))
WALL_M = 0.10


def path_of(positions=((0.0, 0.2, 0.0), (0.05, 0.2, 0.0)), force=10.0):
    """A line worked from above, y being up, with a disc of 25 mm."""
    count = len(positions)
    down = np.tile([np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)], (count, 1))
    segment = Segment("process", 0, np.array(positions), down, 0.1, force)
    return ToolPath("top", "sand", "disc", 0.025, (segment,))


def cell_with(arm, path, distance_field, place=BOWL_PLACE):
    return Cell.build(arm, tool_of(path), distance_field, place, UP)


def bowl_points():
    """Points and normals of a half sphere's shell of 30 mm, open upwards."""
    direction = np.random.default_rng(0).normal(size=(3000, 3))
    direction[:, 1] = -np.abs(direction[:, 1])
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    points = np.concatenate([0.20 * direction, 0.17 * direction])
    return points, np.concatenate([direction, -direction])


def block(low, high, count, rng):
    """Points on a box's faces, and their normals."""
    low, high = np.array(low), np.array(high)
    points, normals = [], []
    for axis in range(3):
        for side, face in ((-1.0, low), (1.0, high)):
            some = rng.uniform(low, high, (count, 3))
            some[:, axis] = face[axis]
            points.append(some)
            normals.append(np.tile(side * np.eye(3)[axis], (count, 1)))
    return np.concatenate(points), np.concatenate(normals)


class WallScene(NamedTuple):
    """cell: Cell, library: SeedLibrary, path: ToolPath, surface: TargetMesh."""

    cell: Any
    library: Any
    path: Any
    surface: Any


def wall_scene(arm) -> WallScene:
    """A plate with a wall across it; a line of 12 waypoints ends beside the wall's foot."""
    rng = np.random.default_rng(0)
    plate = block((-0.15, 0.0, -0.1), (WALL_M, 0.03, 0.1), 1500, rng)
    wall = block((WALL_M, 0.0, -0.1), (WALL_M + 0.03, 0.12, 0.1), 1500, rng)
    points, normals = (np.concatenate(both) for both in zip(plate, wall, strict=True))
    inside = (np.abs(points[:, 0] - WALL_M) < 1e-9) & (points[:, 1] < 0.03)
    points, normals = points[~inside], normals[~inside]
    x = np.linspace(-0.05, WALL_M - 0.0165, 12)
    path = path_of(np.stack([x, np.full(12, 0.03), np.zeros(12)], axis=1))
    cell = cell_with(arm, path, distance_field_from_points(points, normals), WALL_PLACE)
    parts = [
        trimesh.creation.box(bounds=bounds)
        for bounds in (
            ((-0.15, 0.0, -0.1), (WALL_M, 0.03, 0.1)),
            ((WALL_M, 0.0, -0.1), (WALL_M + 0.03, 0.12, 0.1)),
        )
    ]
    mesh = trimesh.util.concatenate(parts)
    surface = TargetMesh.from_mesh(Mesh(np.array(mesh.vertices), np.array(mesh.faces)))
    return WallScene(cell, SeedLibrary.build(cell, 20_000, rng), path, surface)
