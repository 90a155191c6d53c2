"""`nrdf eval unseen` prints a row a method, compared with the first."""

from __future__ import annotations

from pathlib import Path

import pytest

from nrdf.cli import run

BSRC = Path(__file__).parents[4] / "shared" / "bsrc"


def test_a_category_without_a_folder_ends_with_what_to_give(capsys):
    assert run(["eval", "unseen", "--category", "sofa", "--method", "box"]) != 0
    assert "no objects of category sofa: give --objects" in capsys.readouterr().err


@pytest.mark.skipif(not BSRC.is_dir(), reason="needs ../shared/bsrc")
def test_methods_are_compared_with_the_first(capsys):
    words = ["--category", "car", "--method", "box", "copy", "--pairs", "3"]
    assert run(["eval", "unseen", "--bsrc", str(BSRC), *words]) == 0
    shown = capsys.readouterr().out
    assert "car, 3 pairs" in shown and "below box" in shown and "+0.0%" in shown
