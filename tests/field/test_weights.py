"""Weight files: what goes in comes out, and damage is noticed."""

from __future__ import annotations

import json
import os

import pytest
import torch
from safetensors.torch import load_file, save_file

from builders.tiny_field import TinyField
from nrdf.errors import ModelError, OutputError
from nrdf.field import PRESETS, build_field
from nrdf.field.weights import (
    FORMAT,
    _digest,
    load_weights,
    read_metadata,
    save_weights,
)


@pytest.fixture(autouse=True)
def tiny_preset(monkeypatch):
    monkeypatch.setitem(PRESETS, "tiny", "builders.tiny_field:TinyField")


@pytest.fixture
def saved(tmp_path):
    torch.manual_seed(0)
    field = build_field("tiny", {"width": 12})
    path = tmp_path / "ball.safetensors"
    save_weights(path, field, {"category": "ball", "scores": {"val/error": 0.5}})
    return path, field


def test_a_field_survives_in_half_precision(saved):
    path, field = saved
    state = torch.get_rng_state()
    loaded, metadata = load_weights(path, "tiny", "ball")
    assert torch.equal(state, torch.get_rng_state())
    assert isinstance(loaded, TinyField) and loaded.config == field.config and not loaded.training
    for name, value in field.state_dict().items():
        assert loaded.state_dict()[name].dtype == value.dtype
        assert torch.allclose(loaded.state_dict()[name], value, rtol=1e-3, atol=1e-4)
    assert metadata["scores"] == {"val/error": 0.5} and metadata["preset"] == "tiny"
    assert read_metadata(path) == metadata
    assert all(v.dtype != torch.float32 for v in load_file(path).values())
    assert [file.name for file in path.parent.iterdir()] == [path.name]


def test_what_half_precision_cannot_hold_is_kept_in_full(tmp_path):
    field = build_field("tiny")
    with torch.no_grad():
        field.norm.running_var.fill_(1e9)
    save_weights(tmp_path / "x", field, {"category": "ball"})
    assert (load_weights(tmp_path / "x")[0].norm.running_var == 1e9).all()


def test_another_preset_or_category_is_refused(saved):
    path, _ = saved
    with pytest.raises(ModelError, match="weights of category 'ball', not 'chair'"):
        load_weights(path, category="chair")
    with pytest.raises(ModelError, match="weights of preset 'tiny', not 'paper'"):
        load_weights(path, preset="paper")


@pytest.mark.parametrize("kept", [0, 4, 100, -1])
def test_a_truncated_file_is_refused(saved, kept):
    path, _ = saved
    path.write_bytes(path.read_bytes()[:kept])
    with pytest.raises(ModelError, match="truncated"):
        load_weights(path)


@pytest.mark.parametrize("place", [-1, -400])
def test_an_altered_tensor_is_refused(saved, place):
    path, _ = saved
    content = bytearray(path.read_bytes())
    content[place] ^= 1
    path.write_bytes(content)
    with pytest.raises(ModelError, match="altered or damaged"):
        load_weights(path)


def test_altered_metadata_is_refused(saved):
    path, _ = saved
    path.write_bytes(path.read_bytes().replace(b"0.5", b"0.1"))
    with pytest.raises(ModelError, match="altered or damaged"):
        read_metadata(path)


def forged(path, tensors=None, **metadata):
    """A weight file of a tiny field with other tensors and metadata, and a right checksum."""
    field = build_field("tiny", {"width": 12})
    tensors = {**field.state_dict(), **(tensors or {})}
    known = {"format": FORMAT, "preset": "tiny", "category": "ball", "field": {"width": 12}}
    text = {k: json.dumps(v) for k, v in known.items()}
    text |= {k: v if isinstance(v, str) else json.dumps(v) for k, v in metadata.items()}
    text["sha256"] = _digest(tensors, text)
    save_file(tensors, path, metadata=text)
    return path


def test_a_forged_file_that_says_the_truth_is_read(tmp_path):
    assert load_weights(forged(tmp_path / "x"))[0].preset == "tiny"


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_values_that_are_not_finite_are_refused_on_loading(tmp_path, value):
    path = forged(tmp_path / "x", {"norm.running_var": torch.full((12,), value)})
    for read in (load_weights, read_metadata):
        with pytest.raises(ModelError, match=r"'norm\.running_var' has values that are NaN or inf"):
            read(path)


@pytest.mark.parametrize(
    ("metadata", "message"),
    [
        ({"category": "{"}, "does not say what it is"),
        ({"category": "9" * 5000}, "does not say what it is"),
        ({"category": "[" * 100_000}, "does not say what it is"),
        ({"category": 5}, "category: must be text, not 5"),
        ({"preset": ["tiny"]}, "preset: must be text"),
        ({"preset": '"tinny"'}, "no preset 'tinny'"),
        ({"field": []}, "field: must be a mapping"),
        ({"field": "null"}, "field: must be a mapping"),
        ({"field": {"width": "wide"}}, "cannot be built with 'width'"),
        ({"field": {"width": -3}}, "width must be 0 to"),
        ({"field": {"width": 0}}, "do not fit preset 'tiny'"),
        ({"field": {"width": 13}}, r"'decoder\.0\.bias' is \(12,\), not \(13,\)"),
        ({"field": {"width": 900_000}}, r"is \(12,\), not \(900000,\)"),
        ({"field": {"width": 12, "encoder_points": 0}}, "encoder_points must be at least 1"),
        ({"field": {"width": 12, "dropout": 7.0}}, "do not fit preset 'tiny'"),
        ({"scores": {"own": "good"}}, "scores.own: must be a number"),
        ({"shapes": 3}, "shapes: must be a mapping"),
    ],
)
def test_bad_metadata_with_a_right_checksum_is_refused(tmp_path, metadata, message):
    with pytest.raises(ModelError, match=message):
        load_weights(forged(tmp_path / "x", **metadata))


@pytest.mark.parametrize("kind", [torch.bfloat16, torch.complex64, torch.float8_e4m3fn])
def test_types_that_we_never_write_are_refused(tmp_path, kind):
    with pytest.raises(ModelError, match=r"altered or damaged|no weight file"):
        save_file({"x": torch.zeros(3).to(kind)}, tmp_path / "x", {"format": json.dumps(FORMAT)})
        load_weights(tmp_path / "x")


def test_a_pipe_and_a_file_beyond_all_sizes_are_refused(tmp_path, monkeypatch):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(ModelError, match="it is a pipe"):
        load_weights(tmp_path / "pipe")
    monkeypatch.setattr("nrdf.field.weights.LARGEST", 10)
    with pytest.raises(ModelError, match="at most"):
        load_weights(forged(tmp_path / "x"))


def test_files_of_something_else_are_refused(tmp_path):
    with pytest.raises(ModelError, match="no weight file"):
        load_weights(tmp_path / "nothing")
    with pytest.raises(ModelError, match="no weight file"):
        load_weights(tmp_path)
    save_file({"x": torch.zeros(3)}, tmp_path / "x", metadata={"format": json.dumps("pt")})
    with pytest.raises(ModelError, match="no weight file of nrdf"):
        load_weights(tmp_path / "x")


def test_weights_that_do_not_fit_the_preset_are_refused(saved, monkeypatch):
    path, _ = saved

    class Grown(TinyField):
        def __init__(self, config=None):
            super().__init__(config)
            self.more = torch.nn.Linear(2, 2)

    monkeypatch.setattr("builders.tiny_field.TinyField", Grown)
    with pytest.raises(ModelError, match="do not fit preset 'tiny' of this version"):
        load_weights(path)


def test_a_place_that_cannot_be_written_is_an_output_error(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot write"):
        save_weights(tmp_path / "file" / "x", build_field("tiny"), {"category": "ball"})


def test_a_category_is_needed(tmp_path):
    with pytest.raises(ValueError, match="category"):
        save_weights(tmp_path / "x", build_field("tiny"), {})
