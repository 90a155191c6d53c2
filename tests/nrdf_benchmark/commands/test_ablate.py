"""`nrdf ablate` as a user runs it."""

from __future__ import annotations

import json

import pytest
import yaml

from builders.bsrc_folder import member_clouds, write_bsrc
from builders.tiny_ablation import CONFIG
from builders.tiny_field import balls, write_folder
from nrdf import cli
from nrdf.field import PRESETS


@pytest.fixture(autouse=True)
def tiny_preset(monkeypatch):
    monkeypatch.setitem(PRESETS, "tiny", "builders.tiny_field:TinyField")
    monkeypatch.setattr("nrdf.training.progress._tensorboard", lambda folder, step: None)


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    folder = tmp_path_factory.mktemp("data")
    write_folder(folder, balls(7, category="chair"))
    return folder


def test_the_command_trains_scores_and_prints_on_either_ground(data, tmp_path, capsys):
    file = tmp_path / "tiny.yaml"
    file.write_text(yaml.safe_dump(CONFIG.model_dump(mode="json")))
    out, bsrc = (
        tmp_path / "out",
        write_bsrc(tmp_path / "bsrc", "chair", member_clouds("chair", (0, 1))),
    )

    def ablate(*more):
        words = [
            "ablate",
            "chair",
            "--data",
            data,
            "--config",
            file,
            "--device",
            "cpu",
            "--workers",
            1,
        ]
        return cli.run([str(word) for word in [*words, "--workers", 1, "--out", out, *more]])

    assert ablate("--bsrc", tmp_path) == 2
    assert "no BSRC objects in" in capsys.readouterr().err and not out.exists()
    assert ablate("--only", "complete", "cd", "--bsrc", bsrc) == 0
    shown = capsys.readouterr().out
    assert "2 ordered pairs, labels as published" in shown and "| without CD |" in shown
    assert "| without the last stage |" in shown
    assert ablate("--only", "cd", "--pairs", "1", "--seeds", "2") == 0
    assert "named regions of 1 pairs" in capsys.readouterr().out
    content = json.loads((out / "table3.json").read_text())
    assert content["schedule"] == "tiny" and content["versions"]["torch"]
    assert content["variants"][0]["training"]["category"] == "chair"
    named = [(row["variant"], row["seed"]) for row in content["variants"]]
    assert named == [("cd", 0), ("cd", 1), ("shared", 0)]
