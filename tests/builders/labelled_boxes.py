"""Chairs and stools of boxes with a label a face, as a folder of labelled objects."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import trimesh

LABELS = {"other": 0, "seat": 1, "back": 2, "leg": 3, "mixed": 4}
IKEA = Path(__file__).parents[3] / "shared" / "objects" / "ikea"


def box(low, high):
    low, high = np.array(low, float), np.array(high, float)
    return trimesh.creation.box(high - low).apply_translation((low + high) / 2)


def furniture(height: float, back: float):
    """Parts of a chair, +X forward and +Y up: a seat `height` high, a back `back` high, none for 0,
    and four legs."""
    half = 0.22
    parts = [("seat", box((-half, height - 0.05, -half), (half, height, half)))]
    for x in (-half, half - 0.05):
        for z in (-half, half - 0.05):
            parts.append(("leg", box((x, 0, z), (x + 0.05, height - 0.05, z + 0.05))))
    if back:
        parts.append(("back", box((-half, height, -half), (-half + 0.05, height + back, half))))
    return parts


def write_object(root: Path, category: str, name: str, parts, turned: bool = False) -> None:
    meshes = [mesh for _, mesh in parts]
    whole = trimesh.util.concatenate(meshes)
    label = np.concatenate([np.full(len(m.faces), LABELS[part]) for part, m in parts])
    vertices = whole.vertices * ([-1, 1, -1] if turned else 1)
    (root / category).mkdir(parents=True, exist_ok=True)
    np.savez(
        root / category / f"{name}.npz",
        vertices=vertices.astype(np.float32),
        faces=whole.faces.astype(np.int32),
        face_label=label.astype(np.uint8),
    )
    index = root / "index.csv"
    if not index.exists():
        index.write_text("category,name,licence\n")
        (root / "labels.json").write_text(json.dumps({"labels": LABELS}))
    with open(index, "a") as file:
        file.write(f"{category},{name},CC0\n")


def write_objects(root: Path) -> Path:
    """Two chairs and a stool."""
    write_object(root, "chair", "low", furniture(0.4, 0.35))
    write_object(root, "chair", "high", furniture(0.5, 0.5))
    write_object(root, "stool", "plain", furniture(0.45, 0))
    return root
