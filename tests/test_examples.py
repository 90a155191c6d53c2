from __future__ import annotations

import runpy
from pathlib import Path

import pytest

import nrdf
from nrdf.field.zoo import list_models

EXAMPLES = sorted((Path(__file__).parents[1] / "examples").glob("[0-9]*.py"))


def test_examples_are_numbered_without_gaps():
    assert [path.name[:2] for path in EXAMPLES] == [f"{i:02d}" for i in range(1, len(EXAMPLES) + 1)]


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_example_runs(path, untrained, tmp_path, monkeypatch, capsys):
    if "chair" not in {entry.name for entry in list_models()}:
        load_model = nrdf.load_model
        monkeypatch.setattr(nrdf, "load_model", lambda name: load_model(untrained))
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(path), run_name="__main__")
    assert capsys.readouterr().out or list(tmp_path.iterdir())
