"""`nrdf check`: what is wrong is named by field and value."""

from __future__ import annotations

from nrdf import cli


def test_check_shows_what_it_can_and_ends_with_2(taught, capsys):
    path = taught / "box.yaml"
    path.write_text(path.read_text().replace("edge_margin_m: 0.01", "edge_margin_m: 0.4", 1))
    assert cli.run(["check", str(path)]) == 2
    said = capsys.readouterr()
    assert "region 'top', sand: edge_margin_m is 0.4, which leaves nothing" in said.err
    assert "asked for" in said.out and "nothing is wrong" not in said.out


def test_check_finds_a_category_that_no_model_is_for(taught, untrained, capsys):
    path = taught / "box.yaml"
    path.write_text(path.read_text().replace("category: chair", "category: chiar", 1))
    assert cli.run(["check", str(path)]) == 2
    asked = capsys.readouterr().err
    assert "category: no model for the category 'chiar'; did you mean 'chair'?" in asked
    assert "model: general" in asked
    assert cli.run(["check", str(path), "--model", "registration"]) == 0
    assert cli.run(["check", str(path), "--model", str(untrained)]) == 2
    assert "is for chair" in capsys.readouterr().err
    path.write_text(path.read_text().replace("category: chiar", "category: helmet", 1))
    assert cli.run(["check", str(path)]) == 0
    assert "found by the general model" in " ".join(capsys.readouterr().out.split())
    path.write_text(path.read_text().replace("category: helmet", "category: chiar", 1))
    text = path.read_text()
    path.write_text(text.replace("allow_unusual: false", "allow_unusual: true", 1))
    assert path.read_text() != text
    assert cli.run(["check", str(path)]) == 0
