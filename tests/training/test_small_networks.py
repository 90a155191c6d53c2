"""Runs of small networks: they go on where they were killed, and share no folder."""

from __future__ import annotations

import pytest
import torch

from nrdf.errors import OutputError
from nrdf.field.kind_network import KindConfig
from nrdf.io.locks import write_lock
from nrdf.training.small_networks import Settings, run_steps, small_run

FEW = Settings(steps=12, batch=8)


def train(out, settings=FEW, progress=None):
    with small_run("tiny", KindConfig(), "step", settings, ["a-shape"], out, False):
        torch.manual_seed(0)
        network = torch.nn.Linear(4, 2)

        def loss_at(generator: torch.Generator) -> torch.Tensor:
            return network(torch.randn(settings.batch, 4, generator=generator)).square().mean()

        run_steps(network, settings, loss_at, out, progress)
    return network.state_dict()


def test_training_goes_on_where_it_was_killed(tmp_path, monkeypatch):
    monkeypatch.setattr("nrdf.training.small_networks.CHECKPOINT_EVERY", 5)

    def kill(done: int, total: int) -> None:
        if done == 8:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(tmp_path / "run", progress=kill)
    again, whole = train(tmp_path / "run"), train(tmp_path / "whole")
    assert all(torch.equal(whole[name], again[name]) for name in whole)
    with pytest.raises(OutputError, match=r"holds another run: its tiny\.steps is 12, not 30"):
        train(tmp_path / "run", Settings(steps=30, batch=8))


def test_a_second_training_in_the_same_folder_is_refused(tmp_path):
    with write_lock(tmp_path / "run"), pytest.raises(OutputError, match="another run is writing"):
        train(tmp_path / "run")
    assert list(tmp_path.iterdir()) == []
