"""`nrdf eval line`."""

from __future__ import annotations

import json

from nrdf import cli
from nrdf_benchmark.line import kills, objects, speed
from nrdf_benchmark.line.speed import LineSpeed


def test_the_command_writes_what_it_shows_into_a_new_folder(tmp_path, monkeypatch, capsys):
    def write_meshes(folder, *_):
        folder.mkdir(parents=True)

    monkeypatch.setattr(objects, "write_meshes", write_meshes)
    measured = LineSpeed(1, {"done": 2}, 60.0, (2.0, 4.0), (100.0, 100.0))
    monkeypatch.setattr(speed, "measure_line", lambda *_: measured)
    monkeypatch.setattr(kills, "kill_runs", lambda *_: {"kills": 3, "lost": 0})
    words = ["eval", "line", "--data", "x", "--cell", "c.yaml", "--out", str(tmp_path / "new")]
    assert cli.run([*words, "--workers", "1", "--kills", "3"]) == 0
    content = json.loads((tmp_path / "new" / "line.json").read_text())
    assert content["kills"]["lost"] == 0 and content["speed"][0]["cpu_s"] == [2.0, 4.0]
    assert "20.0" in capsys.readouterr().out
    assert cli.run(words) == 2
