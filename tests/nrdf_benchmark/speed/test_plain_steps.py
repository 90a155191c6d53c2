"""Training steps beside the plain reading's."""

from __future__ import annotations

import pytest
import torch

from nrdf.errors import ConfigError
from nrdf.training.config import load_config
from nrdf_benchmark.speed import plain_steps

CONFIG = {
    "preset": "paper",
    "field": {"residual_size": 8, "convolution_size": 8, "decoder_width": 8, "decoder_blocks": 1},
    "data": {"encoder_points": 64, "queries": 32, "correspondences": 0, "cloud_points": 32},
    "stages": [
        {"name": "shape", "weights": {"occupancy": 1}, "steps": 9, "batch_size": 2},
        {"name": "self", "weights": {"occupancy": 1, "self": 1}, "steps": 9, "batch_size": 3},
    ],
}


def test_each_stage_is_timed_on_the_same_work(monkeypatch):
    monkeypatch.setattr(plain_steps, "load_config", lambda name: load_config(CONFIG))
    found = plain_steps.compare_steps("small", torch.get_num_threads(), 1)
    assert [(one.stage, one.shapes) for one in found] == [("shape", 2), ("self", 3)]
    for one in found:
        assert (one.points, one.queries, one.cloud_points) == (64, 32, 32)
        assert min(one.step_s, one.cpu_s, one.plain_step_s, one.plain_cpu_s) > 0


def test_another_network_is_refused():
    with pytest.raises(ConfigError, match="plain reading of the preset 'paper' alone; 'default'"):
        plain_steps.compare_steps("default", torch.get_num_threads(), 1)
