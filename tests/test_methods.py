"""Every method on objects whose answer is known, and the baselines on the real benchmark."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch
from scipy.spatial import cKDTree

from bsrc_folder import member_clouds, write_bsrc
from nrdf.benchmark import methods as module
from nrdf.benchmark.bsrc import BenchmarkObject, read_bsrc
from nrdf.benchmark.evaluate import evaluate
from nrdf.benchmark.methods import DESCRIPTIONS, NAMES, get_method
from nrdf.benchmark.metrics import chamfer_l1
from nrdf.cloud import PointCloud
from nrdf.errors import ConfigError
from nrdf.field import build_field
from nrdf.regions.model import Model
from test_model import SMALL

DEV_HALF = Path(__file__).parents[2] / "shared" / "bsrc"


@pytest.fixture(scope="module")
def model() -> Model:
    torch.manual_seed(0)
    return Model(build_field("default", SMALL), {"category": "chair"})


@pytest.fixture(scope="module")
def objects(tmp_path_factory):
    """chair1 and chair2 are the same object, chair3 is another."""
    clouds = member_clouds("chair", (0, 0, 1))
    return read_bsrc(write_bsrc(tmp_path_factory.mktemp("bsrc"), "chair", clouds), "chair")


@pytest.fixture(autouse=True)
def small(monkeypatch):
    monkeypatch.setattr(module, "_TEMPLATE_POINTS", 400)


def distances(found, target):
    return [chamfer_l1(target.cloud.points[found[r]], target.regions[r]) for r in target.regions]


def test_every_name_has_a_description_and_a_method(model):
    assert set(DESCRIPTIONS) == set(NAMES)
    for name in NAMES:
        assert callable(get_method(name, model))


@pytest.mark.parametrize("name", NAMES)
def test_identical_objects_have_identical_regions(name, objects, model):
    first, second, _ = objects
    found = get_method(name, model)(first, second)
    assert list(found) == list(first.regions)
    snapped = name not in ("nrdf", "registration")
    assert max(distances(found, second)) <= (1e-6 if snapped else 0.05)
    if snapped:
        assert all(len(found[roi]) == len(first.regions[roi]) for roi in found)


@pytest.mark.parametrize("name", NAMES)
def test_another_object_is_searched_too(name, objects, model):
    first, _, third = objects
    found = get_method(name, model)(first, third)
    for indices in found.values():
        assert indices.dtype.kind == "i" and (indices < len(third.cloud)).all()
    assert 0.01 < np.mean(distances(found, third)) < 0.4


def moved(item: BenchmarkObject, change) -> BenchmarkObject:
    cloud = PointCloud(change(item.cloud.points), item.cloud.normals)
    return BenchmarkObject("moved", cloud, {r: change(p) for r, p in item.regions.items()})


@pytest.mark.parametrize("normals", ["", "-normals"])
def test_box_undoes_a_stretched_and_shifted_box_and_copy_does_not(objects, normals):
    first = objects[0]
    target = moved(first, lambda p: p * [0.7, 1.2, 0.9] + [0.1, 0.0, -0.2])
    box = get_method(f"box{normals}")(first, target)
    assert max(distances(box, target)) < 1e-6
    copy = get_method(f"copy{normals}")(first, target)
    assert np.mean(distances(copy, target)) > 0.1


def test_copied_points_are_snapped_one_by_one(objects):
    """Repetitions are kept, in the region's order: a Chamfer distance counts them."""
    first, _, third = objects
    found = get_method("copy")(first, third)
    for roi, points in first.regions.items():
        expected = cKDTree(third.cloud.points).query(points)[1]
        np.testing.assert_array_equal(found[roi], expected)
    assert any(len(np.unique(indices)) < len(indices) for indices in found.values())


def test_the_field_s_points_are_snapped_one_by_one(objects, model):
    first, _, third = objects
    found = get_method("nrdf-points", model)(first, third)
    match = model.set_reference(first.cloud).retrieve_all(first.regions, third.cloud, "points")
    for roi, indices in found.items():
        np.testing.assert_array_equal(np.unique(indices), match[roi].indices)
        assert len(indices) == len(first.regions[roi])


def test_the_field_embeds_each_object_once_for_all_pairs(objects, model, monkeypatch):
    calls = []
    embed = model.field.embed
    monkeypatch.setattr(model.field, "embed", lambda *a: calls.append(1) or embed(*a))
    method = get_method("nrdf", model)
    for _ in range(2):
        for target in objects[1:]:
            method(objects[0], target)
    assert len(calls) == 3  # one reference, two targets


def test_what_cannot_be_run_is_refused():
    with pytest.raises(ConfigError, match="no method 'magic'; known: nrdf, nrdf-points, copy"):
        get_method("magic")
    with pytest.raises(ConfigError, match=r"method 'nrdf' needs the weights of a model \(--model"):
        get_method("nrdf")


# Measured on the public benchmark's objects 1, 3, 5, 7, 9 of each category by other code, copy
# and box to 2 %. With normals it estimated them in another way, by hidden-point removal, so those
# rows only bound ours: better, and not by far.
MEASURED = {
    "chair": {"copy": 0.080, "box": 0.067, "copy-normals": 0.0452, "box-normals": 0.0445},
    "car": {"copy": 0.0154, "box": 0.0131, "copy-normals": 0.0158, "box-normals": 0.0148},
    "plane": {"copy": 0.0435, "box": 0.0409, "copy-normals": 0.0340, "box-normals": 0.0322},
}


@pytest.mark.skipif(
    not DEV_HALF.is_dir(),
    reason="the public BSRC data are not there: get the Benchmark for Surface Region "
    f"Correspondence from the authors of NRDF and put Chair, Car and plane into {DEV_HALF}",
)
@pytest.mark.parametrize("category", list(MEASURED))
def test_baselines_on_the_real_benchmark(category):
    objects = [
        item
        for item in read_bsrc(DEV_HALF, category)
        if item.name.removeprefix(category) in ("1", "3", "5", "7", "9")
    ]
    assert len(objects) == 5
    for name, expected in MEASURED[category].items():
        found = evaluate(name, get_method(name), objects, category).mean
        if name.endswith("normals"):
            assert 0.85 * expected < found < 1.08 * expected, name
        else:
            assert found == pytest.approx(expected, rel=0.02), name
