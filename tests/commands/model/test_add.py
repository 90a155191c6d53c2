"""`nrdf model add`."""

from __future__ import annotations

import json

from nrdf import cli


def test_zoo_add_parses_scores(untrained, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("nrdf.field.zoo.add_to_zoo.__defaults__", (None, None, "", tmp_path))
    words = ["model", "add", str(untrained), "--name", "mine", "--scores", "a=0.5", "b=2"]
    assert cli.run(words) == 0
    index = json.loads((tmp_path / "index.json").read_text())
    assert index["models"]["mine"]["scores"] == {"own": 0.5, "a": 0.5, "b": 2.0}
    assert cli.run([*words[:-1], "b"]) == 2
    assert "name=value" in capsys.readouterr().err
