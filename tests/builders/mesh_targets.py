"""Meshes in metres to plan on, and strokes on them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import trimesh

from nrdf.toolpath.tool_segments import add_approach_retract, tool_segments
from nrdf.toolpath.types import Segment
from nrdf_benchmark.mesh_paths.targets import FINE, MeshTarget

PLATE = replace(FINE, approach_distance_m=0.05, retract_distance_m=0.05)


def plate_target(length: float = 0.4, width: float = 0.2) -> MeshTarget:
    """A block whose top, at height 0 along +Z, is the region "top"."""
    block = trimesh.creation.box((length, width, 0.1)).apply_translation((0, 0, -0.05))
    top = block.face_normals[:, 2] > 0.9
    vertices, faces = np.array(block.vertices), np.array(block.faces)
    return MeshTarget("block", vertices, faces, {"top": top}, "0" * 64, PLATE)


def rows_on_top(places, length: float = 0.4, height: float = 0.0) -> tuple[Segment, ...]:
    """Strokes along +X at places y, one after the other, with their approach and retract."""
    x = np.arange(-0.5 * length, 0.5 * length + 1e-9, PLATE.spacing_m)
    contacts = [np.stack([x, np.full_like(x, y), np.full_like(x, height)], axis=1) for y in places]
    normals = [np.tile([0.0, 0.0, 1.0], (len(x), 1)) for _ in places]
    return add_approach_retract(tool_segments(contacts, normals, PLATE), normals, PLATE)
