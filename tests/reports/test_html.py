"""HTML reports: one file that is complete, escaped and needs no network."""

from __future__ import annotations

import re

import numpy as np
import pytest
from jinja2 import UndefinedError

from builders.taught_box import made_up
from nrdf.process.limits import Limits
from nrdf.reports.html import duration_in_words, image_source, write_html, write_transfer_html
from nrdf.reports.transfer_report import METRIC_COLUMNS, metric_cells, transfer_report


def page_of(folder, result, limits=None, **more):
    """The text of a report's file; `more` is added to the report."""
    (folder / "picture.png").write_bytes(b"picture")
    content = transfer_report(result, limits or Limits())
    report = {"title": "new & <old>", **content, "seconds": {"regions": 1.0}}
    details = {name: np.ones((4, 4, 3)) for name in report["regions"]}
    path = folder / "report.html"
    write_transfer_html(path, {**report, **more}, folder / "picture.png", details)
    return path.read_text()


def test_a_report_shows_its_metrics_and_what_was_requested(tmp_path):
    result = made_up(direction=[1, 0, 0], spindle_rpm=3000)
    page = page_of(tmp_path, result, command="nrdf transfer <x>", versions={"numpy": "2"})
    for name in METRIC_COLUMNS:
        assert name.replace(", ", "<br>") in page
    for cell in metric_cells(vars(result.paths[0].metrics)):
        assert f"<td>{cell}</td>" in page
    for shown in ("1 of 1", "0 min 50 s", "40 mm", "+1.00 +0.00 +0.00", "3000 rpm", "numpy 2"):
        assert shown in page
    assert "the mesh as given (12 triangles)" in page and "planned anew" in page


def test_text_is_escaped_and_nothing_is_fetched(tmp_path):
    page = page_of(tmp_path, made_up(name="sand <fine>"), command="nrdf transfer <x>")
    assert "new &amp; &lt;old&gt;" in page and "<old>" not in page
    assert "sand &lt;fine&gt;" in page and "nrdf transfer &lt;x&gt;" in page
    assert not re.search(r"(src|href)=\"(?!data:image/png;base64,)", page)
    assert "<script" not in page and "@import" not in page and "url(" not in page


def test_limits_and_warnings_are_said(tmp_path):
    page = page_of(tmp_path, made_up(), Limits(min_coverage=0.5))
    assert "Every limit that was set is met." in page and "Look at" not in page
    page = page_of(tmp_path, made_up(confidence=0.3), Limits(max_cycle_time_s=1.0))
    assert "Limits not met" in page and "the cycle time is 50.0 s, above 1 s" in page
    assert "Look at" in page and "confidence 0.30; look at it" in page


def test_a_region_that_was_not_found_has_its_reason_instead_of_metrics(tmp_path):
    page = page_of(tmp_path, made_up(missing="found nowhere"))
    assert f'colspan="{len(METRIC_COLUMNS)}">found nowhere<' in page and "0 of 1" in page


def test_a_template_with_a_missing_value_is_an_error(tmp_path):
    with pytest.raises(UndefinedError, match="report"):
        write_html(tmp_path / "report.html", "transfer.html", {})
    assert not (tmp_path / "report.html").exists()


def test_a_picture_becomes_the_source_of_an_image(tmp_path):
    (tmp_path / "film.webp").write_bytes(b"film")
    assert image_source(tmp_path / "film.webp") == "data:image/webp;base64,ZmlsbQ=="
    assert image_source(tmp_path / "none.png") == ""


def test_durations_are_in_minutes_and_seconds():
    assert duration_in_words(125.4) == "2 min 5 s" and duration_in_words(59.6) == "1 min 0 s"
