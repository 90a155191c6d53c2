"""Checkpoints appear whole or not at all."""

from __future__ import annotations

import json
import os

import pytest
import torch

from builders.tiny_field import TinyConfig, TinyField
from nrdf.errors import ModelError, OutputError
from nrdf.training import checkpoint
from nrdf.training.checkpoint import (
    Position,
    latest_checkpoint,
    load_field_state,
    load_optimizer_state,
    open_run,
    read_position,
    save_checkpoint,
    write_identity,
)


@pytest.fixture
def trained():
    torch.manual_seed(0)
    field = TinyField()
    optimizer = torch.optim.Adam(field.parameters())
    z = field.embed(torch.rand(4, 9, 3), torch.rand(4, 9, 3))
    field.occupancy(z, torch.rand(4, 9, 3)).sum().backward()
    optimizer.step()
    return field, optimizer


def test_everything_comes_back(trained, tmp_path):
    field, optimizer = trained
    average = {name: value + 1 for name, value in field.state_dict().items()}
    save_checkpoint(tmp_path, Position(1, 2, 3), field, optimizer, average)
    found = latest_checkpoint(tmp_path)
    assert read_position(found) == Position(1, 2, 3)
    other = TinyField()
    other_optimizer = torch.optim.Adam(other.parameters())
    back = load_field_state(found, other)
    load_optimizer_state(found, other_optimizer)
    for name, value in field.state_dict().items():
        assert torch.equal(other.state_dict()[name], value)
        assert torch.equal(back[name], value + 1)
    before, after = optimizer.state_dict()["state"], other_optimizer.state_dict()["state"]
    assert before.keys() == after.keys() and len(before) > 0
    for key in before:
        assert torch.equal(before[key]["exp_avg"], after[key]["exp_avg"])


def test_only_the_newest_is_kept(trained, tmp_path):
    for total in (9, 10, 11):
        save_checkpoint(tmp_path, Position(0, total, total), *trained, None)
    assert [path.name for path in (tmp_path / "checkpoints").iterdir()] == ["step-000000011"]


def test_a_failed_write_leaves_the_checkpoint_before(trained, tmp_path, monkeypatch):
    save_checkpoint(tmp_path, Position(0, 1, 1), *trained, None)

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(checkpoint.torch, "save", full)
    with pytest.raises(OutputError, match="No space left on device; free some space"):
        save_checkpoint(tmp_path, Position(0, 2, 2), *trained, None)
    assert [path.name for path in (tmp_path / "checkpoints").iterdir()] == ["step-000000001"]


def test_what_a_killed_write_leaves_is_ignored_and_cleaned(trained, tmp_path):
    save_checkpoint(tmp_path, Position(0, 1, 1), *trained, None)
    (tmp_path / "checkpoints" / ".step-000000002.77.tmp").mkdir()
    assert latest_checkpoint(tmp_path).name == "step-000000001"
    save_checkpoint(tmp_path, Position(0, 3, 3), *trained, None)
    assert [path.name for path in (tmp_path / "checkpoints").iterdir()] == ["step-000000003"]


@pytest.mark.parametrize("name", ["field.safetensors", "optimizer.pt", "position.json"])
def test_a_damaged_checkpoint_is_named(trained, tmp_path, name):
    field, optimizer = trained
    save_checkpoint(tmp_path, Position(0, 1, 1), field, optimizer, None)
    found = latest_checkpoint(tmp_path)
    os.truncate(found / name, 5)
    with pytest.raises(ModelError, match="cannot be used"):
        read_position(found)
        load_field_state(found, field)
        load_optimizer_state(found, optimizer)


def test_a_checkpoint_of_other_sizes_is_refused(trained, tmp_path):
    save_checkpoint(tmp_path, Position(0, 1, 1), *trained, None)
    with pytest.raises(ModelError, match="size mismatch"):
        load_field_state(latest_checkpoint(tmp_path), TinyField(TinyConfig(width=9)))


def test_a_run_is_found_again_and_another_refused(trained, tmp_path):
    run = tmp_path / "run"
    identity = {"config": {"seed": 0, "preset": "tiny"}, "category": "chair"}
    assert open_run(run, identity) is False
    write_identity(run, identity, {"commit": "abc"})
    assert open_run(run, identity) is False
    save_checkpoint(run, Position(0, 1, 1), *trained, None)
    assert open_run(run, identity) is True
    assert json.loads((run / "run.json").read_text())["commit"] == "abc"
    for other, message in (
        ({**identity, "category": "car"}, 'its category is "chair", not "car"'),
        ({**identity, "config": {"seed": 0, "preset": "paper"}}, 'preset is "tiny", not "paper"'),
    ):
        with pytest.raises(OutputError, match=message):
            open_run(run, other)
    assert open_run(run, {"category": "car"}, overwrite=True) is False
    assert latest_checkpoint(run) is None


def test_starting_anew_removes_only_what_training_wrote(trained, tmp_path):
    run = tmp_path / "run"
    open_run(run, {"a": 1})
    write_identity(run, {"a": 1}, {})
    save_checkpoint(run, Position(0, 1, 1), *trained, None)
    (run / "weights.safetensors").symlink_to(tmp_path / "theirs")
    (tmp_path / "theirs").write_text("theirs")
    (run / "thesis.txt").write_text("mine")
    with pytest.raises(OutputError, match=r"holds thesis.txt, which no training run wrote"):
        open_run(run, {"a": 2}, overwrite=True)
    assert latest_checkpoint(run) is not None
    (run / "thesis.txt").unlink()
    assert open_run(run, {"a": 2}, overwrite=True) is False
    assert list(run.iterdir()) == [] and (tmp_path / "theirs").read_text() == "theirs"


def test_a_checkpoint_that_is_there_is_not_lost_for_another_of_the_same_step(trained, tmp_path):
    save_checkpoint(tmp_path, Position(0, 1, 1), *trained, None)
    before = {p: p.stat().st_ino for p in latest_checkpoint(tmp_path).iterdir()}
    save_checkpoint(tmp_path, Position(0, 1, 1), *trained, None)
    assert {p: p.stat().st_ino for p in latest_checkpoint(tmp_path).iterdir()} == before


def test_a_run_cannot_be_where_a_file_is(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot use"):
        open_run(tmp_path / "file" / "run", {})
    with pytest.raises(OutputError, match="cannot use"):
        open_run(tmp_path / "file", {})
