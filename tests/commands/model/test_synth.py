"""`nrdf model synth`."""

from __future__ import annotations

from pathlib import Path

from nrdf import cli


def test_synth_and_correspond_pass_on_what_is_asked(tmp_path, monkeypatch, capsys):
    from nrdf.shapes.correspond import CorrespondReport

    asked = []

    def synthesise(category, count, out, seed, workers, progress):
        asked.append((category, count, out, seed))
        progress(count, count)
        return 2

    def correspond_folders(folders, templates, workers, settings, progress, templates_from):
        asked.append((folders, templates, templates_from))
        return CorrespondReport(["a", "b"], 5, 1)

    monkeypatch.setattr("nrdf.shapes.synth.synthesise", synthesise)
    monkeypatch.setattr("nrdf.shapes.correspond.correspond_folders", correspond_folders)
    assert cli.run(f"model synth car --count 7 --seed 3 --out {tmp_path}".split()) == 0
    words = f"model correspond {tmp_path} other --templates 2 --templates-from other"
    assert cli.run(words.split()) == 0
    assert asked == [("car", 7, tmp_path, 3), ([tmp_path, Path("other")], 2, Path("other"))]
    said = capsys.readouterr().out
    assert "2 shapes made, 5 were there already" in said
    assert "5 shapes registered, 1 were before; templates: a, b" in said
