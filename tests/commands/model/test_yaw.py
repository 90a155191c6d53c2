"""`nrdf model yaw`."""

from __future__ import annotations

from pathlib import Path

from nrdf import cli


def test_what_is_asked_is_passed_on_and_wrong_yaws_are_told(monkeypatch, capsys):
    asked = []

    def train_yaw(category, data, folder, settings, overwrite, progress):
        asked.append((category, data, folder, settings.steps, settings.seed, overwrite))
        return folder / "weights.safetensors"

    monkeypatch.setattr("nrdf.training.yaw_network.train_yaw", train_yaw)
    monkeypatch.setattr(
        "nrdf.field.weights.read_metadata", lambda path: {"scores": {"wrong-yaws": 0.125}}
    )
    words = "model yaw car --data a b --steps 7 --seed 3 --overwrite"
    assert cli.run(words.split()) == 0
    assert asked == [("car", [Path("a"), Path("b")], Path("runs/car-yaw"), 7, 3, True)]
    said = " ".join(capsys.readouterr().out.split())
    assert "wrote runs/car-yaw/weights.safetensors; 12.5 % of views" in said
    assert cli.run(["model", "yaw", "car", "--data", "a", "--out", "there"]) == 0
    assert asked[1][2] == Path("there")
