"""`nrdf eval line`."""

from __future__ import annotations

import json

from nrdf import cli
from nrdf_benchmark.line import hostile, kills, objects, scale_out, speed
from nrdf_benchmark.line.hostile import Attack
from nrdf_benchmark.line.scale_out import Overhead
from nrdf_benchmark.line.speed import LineSpeed


def test_the_command_writes_what_it_shows_into_a_new_folder(tmp_path, monkeypatch, capsys):
    def write_meshes(folder, *_):
        folder.mkdir(parents=True)

    def measure_line(cell, inbox, out, workers):
        (out / "done" / "a").mkdir(parents=True)
        (out / "done" / "a" / "report.json").write_text("{}")
        return LineSpeed(workers, {"done": 2}, 60.0, (2.0, 4.0), (100.0, 100.0))

    found = Attack()
    found.add("garbage", "400", b"")
    found.add("wrong token", "200", b"GET /")
    monkeypatch.setattr(objects, "write_meshes", write_meshes)
    monkeypatch.setattr(speed, "measure_line", measure_line)
    for name in ("kill_runs", "kill_services"):
        monkeypatch.setattr(kills, name, lambda *_: {"kills": 3, "lost": 0})
    monkeypatch.setattr(hostile, "attack_service", lambda *_: (found, "ok"))
    monkeypatch.setattr(scale_out, "measure_overhead", lambda: Overhead(0.001, 0.003))
    words = ["eval", "line", "--data", "x", "--cell", "c.yaml", "--out", str(tmp_path / "new")]
    more = ["--workers", "1", "--kills", "3", "--requests", "2", "--scale-out", "1000", "10"]
    assert cli.run([*words, *more]) == 0
    content = json.loads((tmp_path / "new" / "line.json").read_text())
    assert content["kills"]["serve"]["lost"] == 0 and content["speed"][0]["cpu_s"] == [2.0, 4.0]
    assert content["attack"]["wrong"] == ["wrong token: 200 to b'GET /'"]
    said = capsys.readouterr().out
    assert "20.0" in said and "2 requests, 1 not answered with 4xx" in said
    assert "Dask adds 3.0 ms to a task of 3.00 s: 0.10%" in said
    assert cli.run(words) == 2


def test_what_does_not_go_together_is_refused(tmp_path, capsys):
    words = ["eval", "line", "--out", str(tmp_path / "x")]
    assert cli.run([*words, "--data", "x"]) == 2
    assert cli.run([*words, "--count", "0", "--scale-out", "9", "9"]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "give --data and --cell together" in said and "needs the times of some objects" in said
