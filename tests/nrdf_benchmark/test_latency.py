from __future__ import annotations

import json

import numpy as np
import pytest

from nrdf.errors import NrdfError
from nrdf.training.config import load_config
from nrdf_benchmark import latency
from nrdf_benchmark.commands import evaluate


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


def test_eight_regions_share_the_cloud_out():
    cloud = latency.example(1)
    regions = latency.eight_regions(cloud)
    assert len(regions) == 8 and len(cloud) == latency.POINTS
    np.testing.assert_array_equal(sum(mask.astype(int) for mask in regions.values()), 1)
    assert cloud.normals is None


def test_retrieval_speed_adds_up(untrained):
    speed = latency._retrieval_speed("default", "untrained", untrained, "cpu", 2)
    assert (speed.regions, speed.points, speed.device) == (8, 8192, "cpu")
    assert {"normals", "embed", "map", "associate"} <= set(speed.warm_phases)
    assert 0 < max(speed.warm_phases.values()) < speed.warm_s
    assert sum(speed.warm_phases.values()) == pytest.approx(speed.warm_s, rel=0.5)
    assert 100e6 < speed.peak_memory_bytes < 100e9


def test_training_speed_counts_points(small_config):
    speeds = latency._training_speed("default", "cpu", 1)
    assert [(s.stage, s.batch_size) for s in speeds] == [("shape", 2), ("all", 3)]
    for speed in speeds:
        # A shape of each batch counts its encoder points, queries and one pair's correspondences.
        points = speed.batch_size * (128 + 64 + 32)
        assert speed.points_per_s * speed.step_s == pytest.approx(points, rel=0.1)


def test_measure_reports_what_fails_and_goes_on(monkeypatch, tmp_path, untrained, capsys):
    def alone(function, preset, *arguments):
        if preset == "paper":
            raise NrdfError("no such thing here")
        return function(preset, *arguments)

    monkeypatch.setattr(latency, "_alone", alone)
    monkeypatch.setattr(latency, "command_seconds", lambda *arguments: 4.5)
    monkeypatch.setattr(latency, "_weights", lambda preset, folder: (untrained, "untrained"))
    monkeypatch.setattr(latency, "_training_speed", lambda *arguments: [])
    evaluate.bench(repeats=1, steps=1, out=tmp_path / "bench.json")
    said = json.loads((tmp_path / "bench.json").read_text())
    assert [s["preset"] for s in said["retrieval"]] == ["default"]
    assert said["retrieval"][0]["command_s"] == 4.5
    assert {(f["preset"], f["what"]) for f in said["failures"]} == {
        ("paper", "retrieval"),
        ("paper", "training"),
    }
    shown = capsys.readouterr().out
    assert "no such thing here" in shown and "4.500" in shown


def test_failing_command_is_an_error(tmp_path):
    with pytest.raises(NrdfError, match=r"nrdf retrieve failed.*no model"):
        latency.command_seconds(tmp_path / "missing.safetensors", "cpu", tmp_path)
