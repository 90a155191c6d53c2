"""Two processes on the CPU train one field."""

from __future__ import annotations

import os
import socket
from pathlib import Path

import torch
from torch.multiprocessing import spawn
from torch.nn.parallel import DistributedDataParallel

from builders.tiny_field import TinyField, balls, tiny_config
from nrdf.field import PRESETS
from nrdf.training.checkpoint import latest_checkpoint
from nrdf.training.dataset import ShapeDataset
from nrdf.training.distributed import Workers, join_workers
from nrdf.training.loop import Objective, run_stages


def test_the_first_process_reports():
    assert Workers(0, 2, torch.device("cpu")).first
    assert not Workers(1, 2, torch.device("cpu")).first


STAGE = {"name": "a", "weights": {"correspondence": 1}, "steps": 5, "rate": 0.01, "batch_size": 2}
PAIR = {"stages": [STAGE], "ema": None, "field": {}}


def one_of_two(rank: int, port: int, folder: str) -> None:
    """One of two processes: its own gradients of a first batch, and the weights it ends with."""
    PRESETS["tiny"] = "builders.tiny_field:TinyField"
    os.environ |= {"MASTER_ADDR": "127.0.0.1", "MASTER_PORT": str(port)}
    os.environ |= {"WORLD_SIZE": "2", "RANK": str(rank), "LOCAL_RANK": str(rank)}
    config, out = tiny_config(**PAIR), Path(folder) / "out"
    seen = {}

    def gradients(field):
        return {
            name: value.grad.clone()
            for name, value in field.named_parameters()
            if value.grad is not None
        }

    with join_workers("cpu") as workers:
        dataset = ShapeDataset(balls(8), config.data)
        torch.manual_seed(0)
        objective = Objective(TinyField(), config.stages[0], config, torch.float32)
        shared = DistributedDataParallel(objective, find_unused_parameters=True)
        for name, module in (("own", objective), ("shared", shared)):
            objective.zero_grad()
            batch = dataset.batch(2, 0, 0, workers.rank, workers.world)
            module(batch, torch.Generator())[0].backward()
            seen[name] = gradients(objective.field)
        seen["points"] = batch.points
        if workers.first:
            out.mkdir()
        workers.wait()
        field, _ = run_stages(config, dataset, out, workers, None)
        seen["weights"] = field.state_dict()
        torch.save(seen, Path(folder) / f"{rank}.pt")


def test_two_processes_average_gradients_and_stay_alike(tmp_path):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    spawn(one_of_two, (port, str(tmp_path)), nprocs=2)
    first, second = (torch.load(tmp_path / f"{rank}.pt", weights_only=True) for rank in range(2))
    assert not torch.equal(first["points"], second["points"])
    assert first["shared"].keys() == first["own"].keys() and first["shared"]
    for name, gradient in first["shared"].items():
        assert torch.equal(gradient, second["shared"][name])
        mean = (first["own"][name] + second["own"][name]) / 2
        assert torch.allclose(gradient, mean, atol=1e-6), name
    assert any(not torch.equal(first["own"][name], second["own"][name]) for name in first["own"])
    buffers = ("running_mean", "running_var")
    for name, value in first["weights"].items():
        # Each process counts its own batches in the statistics; the first one's are exported.
        assert name.endswith(buffers) or torch.equal(value, second["weights"][name]), name
    assert latest_checkpoint(tmp_path / "out").name == "step-000000005"
