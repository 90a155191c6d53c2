"""`nrdf model kind`."""

from __future__ import annotations

from pathlib import Path

from nrdf import cli


def test_what_is_asked_is_passed_on_and_mistakes_are_told(monkeypatch, capsys):
    asked = []

    def train_kind(category, data, others, folder, leave_out, settings, overwrite, progress):
        asked.append((category, data, others, folder, leave_out, settings.steps, overwrite))
        assert settings.others_licence == "CC0"
        return folder / "weights.safetensors"

    scores = {"members-refused": 0.02, "others-passed": 0.031}
    monkeypatch.setattr("nrdf.training.kind_network.train_kind", train_kind)
    monkeypatch.setattr("nrdf.field.weights.read_metadata", lambda path: {"scores": scores})
    words = "model kind chair --data a --others b c --leave-out stool bench --steps 9"
    words += " --others-licence CC0"
    assert cli.run(words.split()) == 0
    others, words_out = (Path("b"), Path("c")), ("stool", "bench")
    assert asked == [("chair", (Path("a"),), others, Path("runs/chair-kind"), words_out, 9, False)]
    said = " ".join(capsys.readouterr().out.split())
    assert "2.0% are refused wrongly, 3.1% pass wrongly" in said
