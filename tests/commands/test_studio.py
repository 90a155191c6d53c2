"""`nrdf studio`: what it needs before it opens."""

from __future__ import annotations

import sys

import pytest

from nrdf import cli


def test_without_viser_it_says_what_to_install(tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "viser", None)
    assert cli.run(["studio", "--no-browser", "--session", str(tmp_path / "session")]) == 2
    assert "pip install 'nrdf[studio]'" in " ".join(capsys.readouterr().err.split())


def test_without_a_model_there_is_nothing_to_teach(tmp_path, monkeypatch, capsys):
    pytest.importorskip("viser")
    monkeypatch.setattr("nrdf.field.zoo.list_models", lambda: [])
    assert cli.run(["studio", "--no-browser", "--session", str(tmp_path / "session")]) == 2
    assert "no trained model" in capsys.readouterr().err


@pytest.mark.parametrize("port", ["0", "70000", "-1"])
def test_a_port_is_a_port(port, capsys):
    assert cli.run(["studio", f"--port={port}"]) == 2
    assert "must be from 1 to 65535" in capsys.readouterr().err
