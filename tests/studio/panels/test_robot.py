"""A simulation's result in words."""

from __future__ import annotations

import json
from types import SimpleNamespace

import pytest

from builders.cells import cell_of
from nrdf.cell.file import write_cell
from nrdf.studio.model import cell_upload


def test_verdicts_in_words(playback):
    pytest.importorskip("viser", reason="pip install 'nrdf[studio]'")
    from nrdf.studio.panels.robot import summary

    report = json.loads(json.dumps(playback.report, default=float))
    assert "**100.0%** of 27 waypoints reached, **no** moves with a collision" in summary(report)
    assert "Red points" not in summary(report)
    (path,) = report["paths"]
    path["verdicts"] |= {"reached": 20, "singular": 3, "too fast": 4}
    path["collisions"] = [{"what": "floor", "depth_m": 0.0123}]
    text = summary(report)
    assert "⚠ **top**, not reached: 3 singular, 4 too fast." in text
    assert "*singular*: at a singularity" in text and "*limit*" not in text
    assert "⚠ **top**: 1 move collides, with the floor by up to 12.3 mm" in text


def test_a_cell_file_that_was_sent_is_what_simulations_are_for(page, tmp_path, monkeypatch):
    monkeypatch.setattr(cell_upload, "find_spec", lambda name: None)  # the robot is not loaded
    studio, tab = page.studio, page.studio.panel.robot
    write_cell(tmp_path / "x", cell_of())
    sent = SimpleNamespace(name="x.yaml", content=(tmp_path / "x").read_bytes())
    page.does(tab.refresh)
    assert "for the bundled arm" in tab.cell.content and not tab.without.visible
    page.does(tab._load, sent)
    assert "the cell **cell 3**" in tab.cell.content and tab.without.visible
    assert studio.cell.described == cell_of()
    assert "no cell file" in page.does(
        tab._load, SimpleNamespace(**{**vars(sent), "name": "x.doc"})
    )
    assert studio.cell.described == cell_of()
    page.does(tab._take, type(studio.cell)())
    assert studio.cell.described is None and not (studio.editor.session.folder / "cell").exists()
