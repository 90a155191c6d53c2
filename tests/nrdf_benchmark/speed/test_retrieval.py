"""The speed of retrieval."""

from __future__ import annotations

import pytest

from nrdf.errors import NrdfError
from nrdf_benchmark.speed.retrieval import choose_weights, command_seconds, measure_retrieval


def test_retrieval_speed_adds_up(untrained):
    speed = measure_retrieval("default", "untrained", untrained, "cpu", 2)
    assert (speed.regions, speed.points, speed.device) == (8, 8192, "cpu")
    assert {"normals", "embed", "map", "associate"} <= set(speed.warm_phases)
    assert 0 < max(speed.warm_phases.values()) < speed.warm_s
    assert sum(speed.warm_phases.values()) == pytest.approx(speed.warm_s, rel=0.5)
    assert 100e6 < speed.peak_memory_bytes < 100e9


def test_failing_command_is_an_error(tmp_path):
    with pytest.raises(NrdfError, match=r"nrdf retrieve failed.*no model"):
        command_seconds(tmp_path / "missing.safetensors", "cpu", tmp_path)


def test_the_zoos_weights_of_the_examples_category_are_taken(tmp_path):
    assert choose_weights("default", tmp_path)[1] == "chair"
    assert not list(tmp_path.iterdir())
