"""`nrdf teach`: knowledge files, and their schema."""

from __future__ import annotations

import json

from nrdf import cli
from nrdf.process.knowledge_file import read_knowledge


def test_a_placeholder_says_what_to_do(box_files, capsys):
    words = f"teach --reference {box_files}/box.ply --category chair --out {box_files}/box.yaml"
    assert cli.run(words.split()) == 0
    assert "my-region.ply" in capsys.readouterr().out
    assert cli.run(["check", str(box_files / "box.yaml")]) == 2
    assert "region 'my-region': cannot read" in capsys.readouterr().err
    assert cli.run(words.split()) == 2
    assert "exists; give another name, or --overwrite" in capsys.readouterr().err
    assert cli.run([*words.split(), "--overwrite"]) == 0


def test_a_new_category_is_served_by_the_general_model_and_a_misspelt_one_is_asked_back(
    box_files, capsys
):
    words = f"teach --reference {box_files}/box.ply --out {box_files}/sofa.yaml"
    words += f" --region {box_files}/top.ply --category"
    assert cli.run([*words.split(), "chiar"]) == 2
    assert "did you mean 'chair'?" in capsys.readouterr().err
    assert not (box_files / "sofa.yaml").exists()
    assert cli.run([*words.split(), "sofa"]) == 0
    assert "found by the general model" in " ".join(capsys.readouterr().err.split())
    assert "model: general" in (box_files / "sofa.yaml").read_text()
    assert cli.run(["check", str(box_files / "sofa.yaml")]) == 0
    assert cli.run([*words.split(), "chiar", "--allow-unusual", "--overwrite"]) == 0


def test_json_and_its_schema(taught, tmp_path, capsys):
    words = f"teach --reference {taught}/box.ply --category chair --out {taught}/box.json"
    assert cli.run([*words.split(), "--region", str(taught / "top.ply")]) == 0
    assert json.loads((taught / "box.json").read_text())["version"] == 1
    assert read_knowledge(taught / "box.json").regions[0].name == "top"
    capsys.readouterr()
    assert cli.run(["teach", "--schema"]) == 0
    schema = json.loads(capsys.readouterr().out)
    feed = schema["$defs"]["Process"]["properties"]["feed_m_s"]["description"]
    assert feed.endswith("Plausible: 0.0001 to 5.")
    assert schema["properties"]["regions"] and "2020-12" in schema["$schema"]
    assert cli.run(["teach", "--schema", "--out", str(tmp_path / "s.json")]) == 0
    assert json.loads((tmp_path / "s.json").read_text()) == schema
