"""The evaluation on meshes: planners by name, and going on where it was cut."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from builders.mesh_targets import plate_target, rows_on_top
from nrdf.errors import DataError, ProcessError
from nrdf_benchmark.mesh_paths import evaluate
from nrdf_benchmark.mesh_paths.evaluate import evaluate_mesh_paths, usual_planner
from nrdf_benchmark.mesh_paths.targets import TargetSource
from nrdf_benchmark.result_cache import LineCache


@pytest.fixture
def source():
    return TargetSource("block", "0" * 64, plate_target)


@pytest.fixture
def planned(monkeypatch):
    """Rows instead of a plan; the regions that were planned on."""
    asked = []

    def make(target, planner, strategy, surface):
        return lambda region: asked.append(region) or (rows_on_top([-0.05, -0.025, 0.0]), None)

    monkeypatch.setattr(evaluate, "_on_mesh", make)
    return asked


def test_a_plate_is_planned_and_measured(source):
    (result,) = evaluate_mesh_paths([source])
    assert (result.planner, result.target, result.region) == ("raster", "block", "top")
    assert result.metrics.coverage > 0.99 and result.metrics.distance_worst_m < 1e-6
    assert result.seconds > 0.0 and not result.error


def test_each_mesh_has_a_picture_of_its_paths(source, tmp_path):
    evaluate_mesh_paths([source], pictures=tmp_path)
    (picture,) = tmp_path.iterdir()
    assert picture.name == "block.png"
    pixels = np.asarray(Image.open(picture).convert("RGB")).reshape(-1, 3)
    coloured = np.ptp(pixels.astype(int), axis=1) > 40  # the region and its strokes
    assert coloured.mean() > 0.05


def test_meshes_that_were_done_are_not_planned_again(source, planned, tmp_path):
    told = []
    first = evaluate_mesh_paths([source], cache=LineCache(tmp_path))
    again = evaluate_mesh_paths(
        [source], cache=LineCache(tmp_path), progress=lambda *n: told.append(n)
    )
    assert planned == ["top"] and again == first and told == [(1, 1)]
    changed = TargetSource("block", "1" * 64, plate_target)
    evaluate_mesh_paths([changed], cache=LineCache(tmp_path))
    assert planned == ["top", "top"]


def test_a_region_that_cannot_be_planned_has_its_reason(source, monkeypatch):
    def make(target, planner, strategy, surface):
        def fail(region):
            raise ProcessError("stepover_m is 9")

        return fail

    monkeypatch.setattr(evaluate, "_on_mesh", make)
    (result,) = evaluate_mesh_paths([source])
    assert result.metrics is None and result.error == "stepover_m is 9"


def test_planners_are_told_by_name(source):
    with pytest.raises(DataError, match="raster"):
        evaluate_mesh_paths([source], "rastre")
    (result,) = evaluate_mesh_paths([source], "plane-slices")
    assert result.planner == "plane-slices" and not result.error
    assert result.metrics.distance_worst_m < 1e-6 and result.metrics.coverage > 0.99
    assert result.metrics.step_worst <= 2.0
    assert result.metrics.strokes == 1  # joined on the surface


def test_the_usual_planner_follows_legs_and_rasters_seats():
    assert {usual_planner(name) for name in ("leg", "rail", "arm")} == {"rod"}
    assert {usual_planner(name) for name in ("seat", "back", "top", "bonnet")} == {"raster"}
