"""`nrdf model boxes`."""

from __future__ import annotations

from pathlib import Path

from nrdf import cli


def test_what_is_asked_is_passed_on_and_the_folder_is_the_categorys(tmp_path, monkeypatch, capsys):
    asked = []

    def prepare_boxes(file, folder, category, count, seed, licence, progress):
        asked.append((file, folder, category, count, seed, licence))
        progress(count, count)
        return 3

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("nrdf.shapes.boxes.prepare_boxes", prepare_boxes)
    words = "model boxes parts.npz --category chair --count 4 --seed 2 --licence MIT"
    assert cli.run(words.split()) == 0
    assert cli.run([*words.split(), "--out", "here"]) == 0
    for folder, given in zip(("data/chair-boxes", "here"), asked, strict=True):
        assert given == (Path("parts.npz"), Path(folder), "chair", 4, 2, "MIT")
    assert "3 shapes in data/chair-boxes" in capsys.readouterr().out


def test_a_count_is_one_or_more(capsys):
    assert cli.run(["model", "boxes", "parts.npz", "--category", "chair", "--count", "0"]) == 2
    assert "--count 0 must be 1 or more" in capsys.readouterr().err
