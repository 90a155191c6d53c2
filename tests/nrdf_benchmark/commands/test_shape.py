"""`nrdf eval shape` as a user runs it."""

from __future__ import annotations

import pytest
from PIL import Image

from builders.tiny_field import balls, write_folder
from nrdf import cli


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    folder = tmp_path_factory.mktemp("data")
    write_folder(folder, balls(5, category="chair"))
    return folder


def test_the_command_prints_the_table_or_says_what_is_missing(data, untrained, tmp_path, capsys):
    def shape(*more):
        words = ["eval", "shape", "--data", data, "--resolution", 12, "--workers", 1, *more]
        return cli.run([str(word) for word in words])

    assert shape("--split", "val", "--model", untrained, "--out", tmp_path / "out") == 0
    assert "| `nrdf` |" in capsys.readouterr().out
    assert (tmp_path / "out/table1-chair.json").is_file()
    assert Image.open(tmp_path / "out/table1-chair.png").width > 200
    assert shape("--model", untrained) == 2
    assert (
        "has no shapes of the split 'test'; prepare some (nrdf model prepare"
        in capsys.readouterr().err
    )
    assert shape("--split", "val", "--method", "nrdf-paper", "--runs", tmp_path) == 2
    assert "no weights of method 'nrdf-paper' for category chair" in capsys.readouterr().err
