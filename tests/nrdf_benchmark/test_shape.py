"""Table I: surface and occupancy of a field against the truth."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest
import torch
from scipy.spatial.distance import cdist

from builders.tiny_field import Ball, balls, write_folder
from nrdf.errors import ConfigError, DataError, OutputError
from nrdf.field.base import Field, FieldConfig
from nrdf.io.cloud import PointCloud
from nrdf.regions.model import Model
from nrdf_benchmark.methods.registry import MethodSpec
from nrdf_benchmark.metrics import MISSED
from nrdf_benchmark.shape import (
    Settings,
    check_methods,
    evaluate_shapes,
    find_shapes,
    level_set,
    score_shape,
    table,
    write_results,
)

RADII = (0.5, 0.3, 0.2)
SMALL = Settings(resolution=16, points=200)


class EllipsoidConfig(FieldConfig):
    encoder_points: int = 256


class Ellipsoid(Field):
    """Knows one ellipsoid, whatever it sees; `steep` is the logit's slope across the surface."""

    preset = "ellipsoid"
    Config = EllipsoidConfig

    def __init__(self, steep=500.0, offset=0.0):
        super().__init__()
        self.steep, self.offset = steep, offset

    def embed(self, points, normals):
        return torch.zeros(len(points), 1)

    def occupancy(self, z, queries):
        far = (queries / torch.tensor(RADII)).norm(dim=-1)
        return self.steep * (1 - far) + self.offset

    def describe(self, z, points, normals):
        raise AssertionError("a surface needs no descriptors")

    def invert(self, z, k):
        raise AssertionError("a surface needs no inverse")


def ellipsoid(size=1.0, count=4000) -> Ball:
    """The ellipsoid's surface, evenly by area, and queries of it; smaller than canonical if asked,
    so that frames matter."""
    radii = np.array(RADII) * size
    ball = Ball("ball", category="chair", radii=tuple(radii), count=count)
    rng = np.random.default_rng(0)
    direction = rng.normal(size=(20 * count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    area = np.linalg.norm(direction / radii, axis=1)
    chosen = rng.choice(len(direction), count, replace=False, p=area / area.sum())
    normals = direction[chosen] / radii
    ball.surface_points = (direction[chosen] * radii).astype(np.float32)
    ball.surface_normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    return ball


@pytest.mark.parametrize("size", [1.0, 0.5])
def test_a_field_that_knows_is_as_close_as_another_sample(size):
    shape = ellipsoid(size)
    found = score_shape(Model(Ellipsoid(), {}), shape, Settings(points=4000))
    # Half of the points, so √2 times as far; the surface at 0.75 lies 0.001 inside.
    assert 0.55 * found.sampling < found.cd_l1 < 0.85 * found.sampling
    assert found.mse < 0.002 and not found.is_empty


def test_the_surface_is_where_the_occupancy_is_the_level():
    shape = ellipsoid()
    model = Model(Ellipsoid(steep=5.0), {})
    encoded = model.encode(PointCloud(shape.surface_points, shape.surface_normals))
    for level in (0.75, 0.45):
        vertices, faces = level_set(model, encoded, Settings(level, resolution=48))
        canonical = encoded.canonical(vertices)
        exact = 1 - np.log(level / (1 - level)) / 5.0
        np.testing.assert_allclose(np.linalg.norm(canonical / RADII, axis=1), exact, atol=0.01)
        edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()  # closed


def test_figures_agree_with_brute_force():
    shape = ellipsoid(count=500)
    model = Model(Ellipsoid(steep=3.0, offset=0.7), {})
    found = score_shape(model, shape, Settings(points=300))
    encoded = model.encode(PointCloud(shape.surface_points, shape.surface_normals))
    queries = encoded.canonical(shape.query_points)
    guess = 1 / (1 + np.exp(-(3.0 * (1 - np.linalg.norm(queries / RADII, axis=1)) + 0.7)))
    assert found.mse == pytest.approx(np.mean((guess - shape.query_occupancies) ** 2), abs=1e-6)
    cloud = shape.surface_points[np.random.default_rng(0).permutation(500)[:300]]
    apart = cdist(cloud[::2], cloud[1::2], "cityblock")
    assert found.sampling == pytest.approx(apart.min(0).mean() + apart.min(1).mean(), abs=1e-9)
    # The level set has 1 + (0.7 - log 3)/3 times the ellipsoid's radii: points as far from it.
    scale = 1 + (0.7 - np.log(3)) / 3.0
    other = ellipsoid(count=20000).surface_points * scale
    apart = cdist(cloud, other, "cityblock")
    assert found.cd_l1 > apart.min(1).mean() + apart.min(0).mean() - 0.005
    assert found == score_shape(model, shape, Settings(points=300))


@pytest.mark.parametrize("offset", [-1000.0, 1000.0])
def test_a_field_without_a_surface_counts_as_missed_and_is_named(offset):
    found = score_shape(Model(Ellipsoid(0.0, offset), {}), ellipsoid(count=300), SMALL)
    assert found.cd_l1 == MISSED and found.is_empty
    assert found.mse == pytest.approx(
        np.mean(ellipsoid(count=300).query_occupancies ^ (offset > 0))
    )


def test_settings_that_cannot_be_are_refused():
    for wrong in ({"level": 1.0}, {"resolution": 1}, {"points": 0}):
        with pytest.raises(ConfigError, match="the level must lie between 0 and 1"):
            Settings(**wrong)


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    folder = tmp_path_factory.mktemp("data")
    write_folder(folder, balls(5, category="chair"))
    return folder


@pytest.fixture(scope="module")
def results(data, untrained):
    category, paths = find_shapes(data, "val")
    return evaluate_shapes(category, paths, [MethodSpec("nrdf", untrained)], SMALL)


def test_processes_find_what_one_finds(data, untrained, results):
    category, paths = find_shapes(data, "val")
    told = []
    spec = MethodSpec("nrdf", untrained)
    again = evaluate_shapes(category, paths, [spec], SMALL, 2, lambda *a: told.append(a))
    assert told == [("nrdf", 1, 2), ("nrdf", 2, 2)]
    assert [shape.name for shape in again[0].shapes] == ["ball-3", "ball-4"]
    for one, two in zip(results[0].shapes, again[0].shapes, strict=True):
        assert (one.cd_l1, one.mse) == pytest.approx((two.cd_l1, two.mse), abs=1e-6)


def test_results_are_written_with_every_shape(results, tmp_path):
    shown = table(results, "chair", SMALL)
    assert shown.startswith("| chair, 2 shapes | CD-L1 | MSE | empty |")
    assert f"| `nrdf` | **{results[0].cd_l1:.4f}** | **{results[0].mse:.4f}** |" in shown
    assert "Grid of 16³ nodes" in shown and "Manhattan" in shown
    empty = [shape.name for shape in results[0].shapes if shape.is_empty]
    assert results[0].empty == empty
    assert ("Empty with `nrdf`: " + ", ".join(empty) in shown) == bool(empty)
    write_results(results, "chair", SMALL, tmp_path / "new", {"seed": 0})
    rows = list(csv.DictReader((tmp_path / "new/table1-chair.csv").open()))
    assert [row["shape"] for row in rows] == ["ball-3", "ball-4"]
    assert np.mean([float(row["mse"]) for row in rows]) == pytest.approx(results[0].mse)
    content = json.loads((tmp_path / "new/table1-chair.json").read_text())
    assert content["settings"]["level"] == 0.75 and content["seed"] == 0
    assert content["methods"]["nrdf"]["shapes"][1]["name"] == "ball-4"
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot make"):
        write_results(results, "chair", SMALL, tmp_path / "file", {})


def test_shapes_of_two_categories_are_refused(tmp_path, untrained):
    write_folder(tmp_path, [*balls(3, category="chair"), Ball("cup", category="cup")])
    category, paths = find_shapes(tmp_path, "val")
    with pytest.raises(DataError, match=r"cup.npz is of category cup, others are of chair"):
        evaluate_shapes(category, paths, [MethodSpec("nrdf", untrained)], SMALL)


def test_methods_without_a_field_are_refused():
    with pytest.raises(ConfigError, match="no method with an occupancy field 'copy'; known: "):
        check_methods(["nrdf", "copy"])
