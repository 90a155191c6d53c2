"""The speed of training steps."""

from __future__ import annotations

import pytest
import torch

from nrdf.training.config import load_config
from nrdf_benchmark.speed.training import measure_training, stage_datasets


@pytest.fixture
def small_config(monkeypatch):
    """The default preset's field trained in two stages of very small batches."""
    content = {
        "preset": "default",
        "data": {"encoder_points": 128, "queries": 64, "correspondences": 32, "cloud_points": 64},
        "stages": [
            {"name": "shape", "weights": {"occupancy": 1}, "steps": 9, "batch_size": 2},
            {"name": "all", "weights": {"correspondence": 1}, "steps": 9, "batch_size": 3},
        ],
    }
    monkeypatch.setattr("nrdf.training.config.load_config", lambda preset: load_config(content))


def test_training_speed_counts_points(small_config):
    speeds = measure_training("default", "cpu", 1)
    assert [(s.stage, s.batch_size) for s in speeds] == [("shape", 2), ("all", 3)]
    for speed in speeds:
        # A shape of each batch counts its encoder points, queries and one pair's correspondences.
        points = speed.batch_size * (128 + 64 + 32)
        assert speed.points_per_s * speed.step_s == pytest.approx(points, rel=0.1)


def test_each_stage_draws_points_and_queries_of_its_own():
    config = load_config("paper-short")
    found = stage_datasets(config, torch.device("cpu"))
    sizes = []
    for stage, dataset in found[:2]:
        batch = dataset.batch(stage.batch_size, 0, 0)
        sizes.append((*batch.points.shape[:2], batch.queries.shape[1]))
    assert sizes == [(16, 128, 256), (8, 1024, 512)]
