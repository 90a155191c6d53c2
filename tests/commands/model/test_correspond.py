"""`nrdf model correspond`."""

from __future__ import annotations

from pathlib import Path

from nrdf import cli
from nrdf.shapes.correspond import CorrespondReport


def test_shared_triangulations_come_first_and_are_told(tmp_path, monkeypatch, capsys):
    (tmp_path / "meshes").mkdir()
    monkeypatch.setattr(
        "nrdf.shapes.topology.add_shared_topology", lambda meshes, data: {"g1": ["a", "b"]}
    )
    asked = []

    def correspond_folders(folders, templates, cores, settings, progress, templates_from):
        asked.append((folders, templates, cores))
        return CorrespondReport(["a"], 2, 0)

    monkeypatch.setattr("nrdf.shapes.correspond.correspond_folders", correspond_folders)
    words = ["model", "correspond", str(tmp_path / "data"), "--meshes", str(tmp_path / "meshes")]
    assert cli.run([*words, "--workers", "2"]) == 0
    assert asked == [([Path(tmp_path / "data")], 12, 2)]
    said = capsys.readouterr().out
    assert "2 shapes share their triangulation: group g1" in said
    assert "2 shapes registered, 0 were before; templates: a" in said


def test_it_needs_a_data_folder(capsys):
    assert cli.run(["model", "correspond"]) == 2
    assert "needs one or more data folders" in capsys.readouterr().err
