"""`nrdf model general` hands its options on, and says how far off the field is."""

from __future__ import annotations

import torch

from nrdf.cli import run
from nrdf.field.general import GeneralConfig, GeneralField
from nrdf.field.weights import save_weights


def test_options_reach_the_training_and_the_error_is_said(tmp_path, monkeypatch, capsys):
    seen = {}

    def train(data, out, settings, config, overwrite, progress):
        seen.update(data=data, settings=settings, overwrite=overwrite)
        torch.manual_seed(0)
        field = GeneralField(GeneralConfig(tokens=8, width=8, heads=2, looks=1))
        scores = {"assemblies": 0.031}
        save_weights(out / "w.safetensors", field, {"category": "", "scores": scores})
        return out / "w.safetensors"

    monkeypatch.setattr("nrdf.training.general_field.train_general", train)
    (tmp_path / "d").mkdir()
    words = ["--data", str(tmp_path / "d"), "--out", str(tmp_path), "--steps", "5"]
    assert run(["model", "general", *words, "--families", "chair", "car", "--kinds", "3"]) == 0
    assert seen["data"] == (tmp_path / "d",) and not seen["overwrite"]
    settings = seen["settings"]
    assert (settings.steps, settings.kinds, settings.families) == (5, 3, ("chair", "car"))
    assert "off by 3.1%" in capsys.readouterr().out
