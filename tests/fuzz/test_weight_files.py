"""Weights, zoo indexes and region files from outside, damaged in every way."""

from __future__ import annotations

import io
import json

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from safetensors.torch import save

from builders.fuzzing import altered, damaged, outcome_of, tries
from builders.tiny_field import TinyConfig, TinyField
from nrdf.errors import ModelError, NrdfError, RegionError
from nrdf.field import PRESETS
from nrdf.field.base import Field
from nrdf.field.weights import FORMAT, _digest, load_weights
from nrdf.field.zoo import ZooEntry, list_models
from nrdf.regions.files import read_region_file


@pytest.fixture(autouse=True)
def tiny_preset(monkeypatch):
    monkeypatch.setitem(PRESETS, "tiny", "builders.tiny_field:TinyField")


@pytest.fixture
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("weights")


METADATA = {
    "format": FORMAT,
    "preset": "tiny",
    "category": "ball",
    "field": {"width": 12, "encoder_points": 256, "dropout": 0.0},
    "scores": {"own": 0.5},
    "shapes": {"family": {"count": 3, "licences": {"MIT": 3}}},
}


with torch.random.fork_rng():
    torch.manual_seed(0)
    TENSORS = dict(TinyField(TinyConfig(width=12)).state_dict())


def weights(metadata) -> bytes:
    """A weight file of a tiny field, with a right checksum."""
    entries = metadata if isinstance(metadata, dict) else {}
    text = {str(key): json.dumps(value) for key, value in entries.items()}
    text["sha256"] = _digest(TENSORS, text)
    return save(TENSORS, metadata=text)


VALID = weights(METADATA)


def check(path):
    outcome = outcome_of(lambda: load_weights(path))
    if isinstance(outcome, NrdfError):
        assert isinstance(outcome, ModelError)
    else:
        field, metadata = outcome
        assert isinstance(field, Field) and isinstance(metadata["category"], str)
        assert all(value.isfinite().all() for value in field.state_dict().values())


@tries(150)
@given(damaged(VALID))
def test_damaged_weights(folder, content):
    (folder / "a.safetensors").write_bytes(content)
    check(folder / "a.safetensors")


@tries(150)
@given(altered(METADATA))
def test_weights_that_say_other_things_with_a_right_checksum(folder, metadata):
    (folder / "a.safetensors").write_bytes(weights(metadata))
    check(folder / "a.safetensors")


ENTRY = {
    "file": "a.safetensors", "sha256": "0" * 64, "bytes": 5, "category": "ball", "preset": "tiny",
    "scores": {"own": 0.5}, "shapes": {}, "commit": None, "date": "2026-11-29", "note": "",
}  # fmt: skip


@tries(150)
@given(altered({"models": {"ball": ENTRY}}))
def test_altered_zoo_indexes(folder, tree):
    (folder / "index.json").write_text(json.dumps(tree))
    outcome = outcome_of(lambda: list_models(folder))
    if not isinstance(outcome, ModelError):
        assert all(isinstance(entry, ZooEntry) and "/" not in entry.file for entry in outcome)


def _saved(write, *arrays, **named) -> bytes:
    file = io.BytesIO()
    write(file, *arrays, **named)
    return file.getvalue()


REGIONS = {
    "mask.npy": _saved(np.save, np.array([True, False, True])),
    "indices.npy": _saved(np.save, np.arange(5)),
    "points.npy": _saved(np.save, np.eye(3)),
    "several.npz": _saved(np.savez_compressed, seat=np.arange(5), back=np.eye(3)),
    "cloud.npz": _saved(np.savez, points=np.eye(3)),
}


@tries(300)
@given(st.data())
def test_damaged_region_files(folder, data):
    name = data.draw(st.sampled_from(sorted(REGIONS)))
    path = folder / name
    path.write_bytes(data.draw(damaged(REGIONS[name])))
    outcome = outcome_of(lambda: read_region_file(path))
    if isinstance(outcome, NrdfError):
        assert name in str(outcome)
    else:
        for values in outcome.values():
            assert values.dtype.kind in "biuf" and values.ndim in (1, 2)


def test_a_region_file_that_is_no_array_names_what_is_wrong(folder):
    (folder / "a.npy").write_bytes(b"nothing")
    assert isinstance(outcome_of(lambda: read_region_file(folder / "a.npy")), RegionError)
