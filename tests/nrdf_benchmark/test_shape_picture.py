"""The picture of surfaces: a row for what was given and for each method, holes where none is."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from builders.tiny_field import balls, write_folder
from nrdf.geometry.mesh import Mesh
from nrdf.regions.model import Model
from nrdf_benchmark import shape_picture
from nrdf_benchmark.methods.registry import MethodSpec
from nrdf_benchmark.shape import Settings, find_shapes
from nrdf_benchmark.shape_picture import COLUMNS, draw_surfaces


@pytest.fixture
def shapes(tmp_path):
    (tmp_path / "data").mkdir()
    write_folder(tmp_path / "data", balls(9, category="chair"))
    return find_shapes(tmp_path / "data", "train")[1]


def picture(shapes, surface, path, monkeypatch) -> np.ndarray:
    monkeypatch.setattr(shape_picture, "model_of", lambda spec: _Encodes())
    monkeypatch.setattr(shape_picture, "level_set", surface)
    specs = [MethodSpec("nrdf"), MethodSpec("ndf")]
    draw_surfaces(shapes, specs, Settings(), path, size=60)
    return np.asarray(Image.open(path).convert("L")).astype(float)


class _Encodes(Model):
    def __init__(self):
        pass

    def encode(self, cloud, *more):
        return cloud


def test_every_method_has_a_row_and_what_has_no_surface_stays_empty(shapes, tmp_path, monkeypatch):
    calls = []

    def surface(model, encoded, settings):
        calls.append(encoded)
        mesh = Mesh(
            np.array([[0, 0, 0], [0.4, 0, 0], [0, 0.4, 0], [0, 0, 0.4]], float),
            np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]),
        )
        return None if len(calls) == 2 else (mesh.vertices, mesh.faces)

    image = picture(shapes, surface, tmp_path / "x.png", monkeypatch)
    columns = min(COLUMNS, len(shapes))
    assert image.shape[1] == 60 * columns and len(calls) == 2 * columns
    row = image.shape[0] // 3
    cells = image.reshape(3, row, columns, 60)[:, 28:]
    dark = (cells < 200).any(axis=(1, 3))
    assert not dark[1, 1] and dark.sum() == 3 * columns - 1
