"""Names, weights and the one call of every method."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from builders.bsrc_folder import member_clouds
from builders.small_model import SMALL
from nrdf.errors import ConfigError, ModelError
from nrdf.field import build_field
from nrdf.field.weights import load_weights, save_weights
from nrdf.io.cloud import PointCloud
from nrdf_benchmark.methods import registry
from nrdf_benchmark.methods.registry import METHODS, MethodSpec, build_method, find_methods

SIZES = {
    "default": SMALL,
    "ndf": {
        "encoder_points": 128, "centres": 32, "neighbours": 8, "edge_channels": 8, "hidden": 8,
        "encoder_blocks": 1, "latent": 8, "decoder_width": 8, "decoder_blocks": 1,
    },
    "imdc": {"encoder_points": 256, "implicit_widths": (32, 16), "inverse_width": 16},
}  # fmt: skip


def save(path: Path, preset: str = "default", category: str = "chair") -> Path:
    torch.manual_seed(0)
    path.parent.mkdir(parents=True, exist_ok=True)
    save_weights(path, build_field(preset, SIZES[preset]), {"category": category})
    return path


def test_methods_without_weights_need_nothing():
    names = [name for name, entry in METHODS.items() if not entry.is_learned]
    assert find_methods(names, "chair") == [MethodSpec(name) for name in names]
    copies = ["copy", "box", "copy-normals", "box-normals"]
    assert names == [*copies, "box-mask", "registration", "registration-model"]


def test_the_default_field_comes_from_the_zoo_unless_a_model_is_given(tmp_path):
    (spec,) = find_methods(["nrdf"], "car")
    assert spec.weights.name == "car.safetensors" and len(spec.sha256) == 64
    mine = save(tmp_path / "a=b.safetensors")
    both = find_methods(["nrdf", "nrdf-points", "copy"], "chair", [str(mine)])
    assert [spec.weights for spec in both] == [mine.resolve(), mine.resolve(), None]
    only = find_methods(["nrdf", "nrdf-points"], "chair", [f"nrdf-points={mine}"])
    assert [spec.weights.name for spec in only] == ["chair.safetensors", "a=b.safetensors"]


def test_the_general_field_serves_every_category(tmp_path):
    (spec,) = find_methods(["general"], "sofa")
    assert spec.weights.name == "general.safetensors"
    with pytest.raises(ModelError, match=r"needs weights of preset 'general', but .* 'default'"):
        find_methods(["general"], "sofa", ["general=chair"])


def test_rivals_come_from_the_runs_unless_a_model_is_given(tmp_path):
    trained = save(tmp_path / "runs" / "chair-imdc" / "weights.safetensors", "imdc")
    (spec,) = find_methods(["imdc"], "chair", runs=tmp_path / "runs", device="cuda")
    assert (spec.weights, spec.device) == (trained.resolve(), "cuda")
    other = save(tmp_path / "other.safetensors", "imdc")
    (spec,) = find_methods(["imdc"], "chair", [f"imdc={other}"], tmp_path / "runs")
    assert spec.weights == other.resolve()


def test_rivals_that_were_not_trained_here_come_from_the_benchmarks_zoo(tmp_path, monkeypatch):
    monkeypatch.setattr(registry, "ZOO", tmp_path)
    shipped = save(tmp_path / "chair-ndf.safetensors", "ndf")
    (spec,) = find_methods(["ndf"], "chair", runs=tmp_path / "runs")
    assert spec.weights == shipped.resolve()
    trained = save(tmp_path / "runs" / "chair-ndf" / "weights.safetensors", "ndf")
    (spec,) = find_methods(["ndf"], "chair", runs=tmp_path / "runs")
    assert spec.weights == trained.resolve()


@pytest.mark.parametrize("category", ["chair", "car", "plane"])
def test_ndf_comes_with_the_benchmark(tmp_path, category):
    (spec,) = find_methods(["ndf"], category, runs=tmp_path)
    assert spec.weights == registry.ZOO / f"{category}-ndf.safetensors"
    assert spec.weights.stat().st_size < 4e6
    field, metadata = load_weights(spec.weights, "ndf", category)
    assert field.config.descriptor_size == 769 and metadata["shapes"]


@pytest.mark.parametrize(
    "name, run", [("ndf", "ndf"), ("ndf-energy", "ndf"), ("imdc", "imdc"), ("nrdf-paper", "paper")]
)
def test_missing_weights_are_named_with_the_command_that_makes_them(
    tmp_path, monkeypatch, name, run
):
    monkeypatch.setattr(registry, "ZOO", tmp_path / "zoo")
    with pytest.raises(ModelError) as raised:
        find_methods(["copy", name], "plane", runs=tmp_path)
    said = str(raised.value)
    assert f"no weights of method '{name}' for category plane: expected {tmp_path}" in said
    assert f"plane-{run}/weights.safetensors" in said
    assert f"nrdf model train plane --preset {run}-short --data data/plane data/plane-f" in said


def test_weights_of_another_category_or_preset_are_refused(tmp_path):
    with pytest.raises(ModelError, match=r"needs weights of category 'car', but .* 'chair'"):
        find_methods(["nrdf"], "car", ["chair"])
    imdc = save(tmp_path / "imdc.safetensors", "imdc")
    with pytest.raises(ModelError, match=r"needs weights of preset 'default', but .* 'imdc'"):
        find_methods(["nrdf"], "chair", [str(imdc)])


def test_what_cannot_be_asked_for_is_refused():
    with pytest.raises(ConfigError, match="no method 'magic'; known: copy, box"):
        find_methods(["magic"], "chair")
    with pytest.raises(ConfigError, match="method 'copy' is given twice"):
        find_methods(["copy", "box", "copy"], "chair")
    with pytest.raises(ConfigError, match="no method given; known: copy"):
        find_methods([], "chair")
    with pytest.raises(ConfigError, match="method 'copy' learns nothing"):
        find_methods(["copy"], "chair", ["copy=x.safetensors"])
    with pytest.raises(ModelError, match=r"no model 'nothing\.safetensors'"):
        find_methods(["nrdf"], "chair", ["nothing.safetensors"])


@pytest.mark.parametrize("name", ["nrdf", "nrdf-points", "imdc", "ndf", "copy", "box-normals"])
def test_every_method_answers_the_same_call(name, tmp_path):
    (points, regions), (other, _) = member_clouds("chair", (0, 1))
    preset = METHODS[name].preset
    weights = save(tmp_path / "w.safetensors", preset) if preset else None
    match = build_method(MethodSpec(name, weights))
    asked = {"points": points[regions[0]], "indices": regions[1]}
    found = match(PointCloud(points), asked, PointCloud(other))
    assert list(found) == ["points", "indices"]
    for indices in found.values():
        assert indices.dtype.kind == "i" and (indices >= 0).all() and (indices < len(other)).all()
    again = match(PointCloud(points), {"points": regions[0]}, PointCloud(other))
    np.testing.assert_array_equal(again["points"], found["points"])
