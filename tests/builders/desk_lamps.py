"""Meshes of one simple kind of object with a clear front, for tests of learning a kind."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh

from nrdf.shapes.dataset import Shape


def lamp(seed: int) -> trimesh.Trimesh:
    """A foot, a post at its rear end and a shade above its front end, +X forward, +Y up."""
    rng = np.random.default_rng(seed)
    length, height, width = rng.uniform((0.4, 0.6, 0.15), (0.7, 1.0, 0.35))
    shade = rng.uniform(0.3, 0.5) * length
    boxes = [
        ((length, 0.06, width), (0.0, 0.03, 0.0)),
        ((0.06, height, 0.06), (-0.4 * length, height / 2, 0.0)),
        ((0.8 * length, 0.05, 0.05), (0.0, height, 0.0)),
        ((shade, 0.15, 0.8 * width), (0.4 * length, height - 0.05, 0.0)),
    ]
    parts = []
    for sides, centre in boxes:
        part = trimesh.creation.box(sides)
        parts.append(part.apply_translation(centre))
    return trimesh.util.concatenate(parts)


def write_lamps(folder: Path, count: int, yaws: dict[int, float] | None = None) -> list[str]:
    """Write lamps 0 to `count` - 1, those of `yaws` turned about +Y (rad); the files' names."""
    folder.mkdir(parents=True, exist_ok=True)
    names = []
    for seed in range(count):
        mesh = lamp(seed)
        turn = trimesh.transformations.rotation_matrix((yaws or {}).get(seed, 0.0), [0, 1, 0])
        mesh.apply_transform(turn)
        names.append(f"lamp{seed}.ply")
        mesh.export(folder / names[-1])
    return names


def sampled(mesh: trimesh.Trimesh, name: str, seed: int) -> Shape:
    """A shape of a mesh, sampled by a seed, without queries."""
    points, face = trimesh.sample.sample_surface(mesh, 8192, seed=seed)
    points = (points - mesh.bounds.mean(0)) / mesh.extents.max()
    none = np.zeros((0, 3), np.float32)
    return Shape(name, "lamp", "mesh", points, mesh.face_normals[face], none, np.zeros(0, bool))
