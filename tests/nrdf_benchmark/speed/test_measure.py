"""All measurements of speed, one after the other."""

from __future__ import annotations

from nrdf.errors import NrdfError
from nrdf_benchmark.speed import measure as module
from nrdf_benchmark.speed.training import TrainingSpeed


def test_what_a_preset_cannot_do_is_a_failure_and_the_others_are_measured(monkeypatch):
    speed = TrainingSpeed("default", "shape", "cpu", 2, "float32", 0.5, 100.0, 10**9, None)

    def run(function, preset, *arguments):
        if preset == "paper" or function is not module.measure_training:
            raise NrdfError(f"{preset} cannot")
        return [speed]

    monkeypatch.setattr(module, "in_new_process", run)
    told = []
    retrieval, training, failures = module.measure(("default", "paper"), progress=told.append)
    assert retrieval == [] and training == [speed]
    assert [(f.preset, f.what, f.reason) for f in failures] == [
        ("default", "retrieval", "default cannot"), ("paper", "retrieval", "paper cannot"),
        ("paper", "training", "paper cannot"),
    ]  # fmt: skip
    assert told[:2] == ["default: retrieval", "default: training steps"]
    content = module.to_json(retrieval, training, failures)
    assert content["training"][0]["step_s"] == 0.5 and content["bars"] == module.BARS
    assert module.measure(("default",), steps=0)[1] == []
