"""Runs of the small networks: they go on where they were killed, and share no folder."""

from __future__ import annotations

import pytest
import torch

from nrdf.errors import OutputError
from nrdf.field.weights import load_tensors
from nrdf.io.locks import write_lock
from nrdf.training.yaw_network import YawSettings, train_yaw

FEW = YawSettings(steps=12, batch=8)


def test_training_goes_on_where_it_was_killed(folder, tmp_path, monkeypatch):
    monkeypatch.setattr("nrdf.training.small_networks.CHECKPOINT_EVERY", 5)

    def kill(done: int, total: int) -> None:
        if done == 8:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train_yaw("step", [folder], tmp_path / "run", FEW, progress=kill)
    again = train_yaw("step", [folder], tmp_path / "run", FEW)
    whole = train_yaw("step", [folder], tmp_path / "whole", FEW)
    one, two = load_tensors(whole)[1], load_tensors(again)[1]
    assert all(torch.equal(one[name], two[name]) for name in one)
    with pytest.raises(OutputError, match=r"holds another run: its yaw\.steps is 12, not 30"):
        train_yaw("step", [folder], tmp_path / "run", YawSettings(steps=30, batch=8))


def test_a_second_training_in_the_same_folder_is_refused(folder, tmp_path):
    with write_lock(tmp_path / "run"), pytest.raises(OutputError, match="another run is writing"):
        train_yaw("step", [folder], tmp_path / "run", FEW)
    assert list(tmp_path.iterdir()) == []
