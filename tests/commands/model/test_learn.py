"""`nrdf model learn`."""

from __future__ import annotations

import json
from functools import partial

import pytest

from builders.desk_lamps import write_lamps
from nrdf import cli
from nrdf.field import zoo
from nrdf.learn import judge
from nrdf.process.model_choice import choose_model
from nrdf.training.general_field import FineTuneSettings


@pytest.fixture
def own_zoo(tmp_path, monkeypatch):
    monkeypatch.setattr(zoo, "user_data_path", lambda *_, **__: tmp_path / "data")
    monkeypatch.setattr(judge, "COPIES", 1)
    monkeypatch.setattr(judge, "REFERENCES", 1)
    few = partial(FineTuneSettings, batch=2, kinds=1)
    monkeypatch.setattr("nrdf.training.general_field.FineTuneSettings", few)
    return tmp_path / "data" / "zoo"


def test_one_command_gives_a_model_that_knowledge_of_the_category_uses(tmp_path, own_zoo, capsys):
    write_lamps(tmp_path / "in", 3)
    words = f"model learn {tmp_path}/in --category lamp --out {tmp_path}/out --steps 1 --workers 1"
    assert cli.run(words.split()) == 0
    said = capsys.readouterr()
    assert "learned from 2 objects; judged on 1" in said.out
    assert "against registration" in said.out and "one object only" in said.out
    assert f"the model 'lamp' is now in your zoo ({own_zoo})" in said.out
    assert "training (step 4 of 5)" in said.err
    assert {p.name for p in own_zoo.iterdir()} == {"index.json", "lamp.safetensors"}
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["category"] == "lamp" and report["errors"]["exact"]
    assert (tmp_path / "out" / "held-out.png").is_file()
    chosen = choose_model("lamp")
    assert chosen.name == "lamp" and not chosen.note
    assert cli.run(["info"]) == 0
    assert "lamp, your own: " in capsys.readouterr().out


@pytest.mark.parametrize(
    ("category", "said"),
    [
        ("registration", "the name of a model for any category"),
        ("a/b", "'a/b' is no name for a category: it may have no separators"),
    ],
)
def test_what_is_no_category_is_refused_before_anything_is_made(tmp_path, capsys, category, said):
    write_lamps(tmp_path / "in", 3)
    words = ["model", "learn", f"{tmp_path}/in", "--category", category, "--out", f"{tmp_path}/o"]
    assert cli.run(words) == 2
    assert said in capsys.readouterr().err and not (tmp_path / "o").exists()


def test_an_empty_folder_and_a_missing_one_are_said(tmp_path, capsys):
    for folder in ("empty", "missing"):
        (tmp_path / "empty").mkdir(exist_ok=True)
        words = f"model learn {tmp_path}/{folder} --category lamp --out {tmp_path}/out"
        assert cli.run(words.split()) == 2
        assert f"{tmp_path}/{folder}" in capsys.readouterr().err
