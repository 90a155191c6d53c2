"""What a line is measured on: labelled meshes, or small clouds that cost little.

All are stretched at random within 8 % along each axis, so that no two are the same.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from importlib.resources import as_file, files
from pathlib import Path

import numpy as np

from nrdf.bundled import REFERENCE, TARGETS, bundled_chair
from nrdf.cell.file import new_cell, write_cell
from nrdf.geometry.sampling import downsample
from nrdf_benchmark.objects.dataset import read_objects

_STRETCH = 0.08
_LIGHT_POINTS = 2048
_KNOWLEDGE = """\
version: 1
category: chair
reference: {cloud: reference.npz, unit: m}
regions:
  - name: seat
    file: reference-regions.npz
    processes:
      - kind: paint
        trajectory: plane-slices
        stepover_mm: 60
        spacing_mm: 40
        tool: {name: spray gun, radius_mm: 60}
        standoff_mm: 150
        feed_mm_s: 300
"""


def write_meshes(
    folder: Path, data: Path, categories: Sequence[str], count: int, seed: int
) -> None:
    """Write `count` stretched labelled meshes into a new folder."""
    import trimesh

    rng = np.random.default_rng(seed)
    objects = read_objects(data, list(categories))
    folder.mkdir(parents=True)
    for number in range(count):
        of = objects[number % len(objects)]
        mesh = trimesh.Trimesh(of.vertices * _stretch(rng), of.faces, process=False)
        name = f"{of.entry.category}-{of.entry.name}-{number:04}.ply"
        mesh.export(folder / name)


def write_light_objects(folder: Path, count: int, seed: int) -> None:
    """Write `count` of the package's chairs, stretched, as small clouds into a new folder."""
    folder.mkdir(parents=True)
    for number, content in enumerate(light_objects(count, seed)):
        (folder / f"chair-{number:04}.csv").write_bytes(content)


def light_objects(count: int, seed: int) -> list[bytes]:
    """The files' contents: CSV, metres."""
    rng = np.random.default_rng(seed)
    clouds = [bundled_chair(name)[0].points for name in (REFERENCE, *TARGETS)]
    contents = []
    for number in range(count):
        points = clouds[number % len(clouds)]
        points = points[downsample(points, _LIGHT_POINTS, rng)] * _stretch(rng)
        text = io.StringIO()
        np.savetxt(text, points, fmt="%.5f", delimiter=",", header="x [m],y [m],z [m]", comments="")
        contents.append(text.getvalue().encode())
    return contents


def write_light_cell(folder: Path) -> Path:
    """Write a cell file for light objects, with one process on one region; its path."""
    with as_file(files("nrdf.bundled")) as bundled:
        for name in ("reference.npz", "reference-regions.npz"):
            (folder / name).write_bytes((bundled / name).read_bytes())
    knowledge, cell = folder / "light.yaml", folder / "cell.yaml"
    knowledge.write_text(_KNOWLEDGE, encoding="utf-8")
    write_cell(cell, new_cell([knowledge], "light", ["urscript"], folder))
    return cell


def _stretch(rng: np.random.Generator) -> np.ndarray:
    return rng.uniform(1.0 - _STRETCH, 1.0 + _STRETCH, 3)
