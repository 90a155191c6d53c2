"""The page and the table of a line's objects."""

from __future__ import annotations

import csv
import io

import pytest

from nrdf.serve.store import ObjectRow
from nrdf.serve.summary import csv_text, doubtful_first, page_content, write_summary


def row(id, state, name="a", reason="", **figures):
    return ObjectRow(id, name, f"/in/{name}", 1, 1, name, state, reason, 1, 0.0, 1.0, 2.5, figures)


ROWS = [
    row(1, "done", "sure", paths=2, confidence=0.9, coverage=0.99, cycle_time_s=61.0),
    row(2, "done", "unsure", paths=2, confidence=0.5, coverage=0.99),
    row(3, "look-at", "<b>odd", "=HYPERLINK()", paths=2, confidence=0.8, coverage=0.4),
    row(4, "refused", "bad", "no cloud"),
]


def test_the_most_doubtful_come_first_and_what_has_no_job_not_at_all():
    assert [r.id for r in doubtful_first(ROWS)] == [3, 2, 1]


def test_the_table_has_every_object_and_no_formula():
    read = list(csv.DictReader(io.StringIO(csv_text(ROWS))))
    assert [r["state"] for r in read] == ["done", "done", "look-at", "refused"]
    assert read[2]["reason"] == "'=HYPERLINK()" and read[0]["seconds"] == "1.5"
    assert read[3]["confidence"] == ""


def test_the_page_shows_pictures_and_escapes_names(tmp_path):
    write_summary(tmp_path, ROWS, "cell <3>", refresh_s=10)
    page = (tmp_path / "index.html").read_text()
    assert "cell &lt;3&gt;" in page and "&lt;b&gt;odd" in page and "<b>odd" not in page
    assert 'src="done/sure/picture.png"' in page and 'href="refused/bad/reason.txt"' in page
    assert "1 min 1 s" in page and page.index("odd, look-at") < page.index("unsure, done")
    assert (tmp_path / "objects.csv").read_text().count("\n") == 5


def test_a_page_shows_so_many_and_says_how_many_there_are(monkeypatch):
    monkeypatch.setattr("nrdf.serve.summary.MOST_SHOWN", 2)
    content = page_content(ROWS, "x")
    assert content["total"] == 4 and len(content["rows"]) == 2
    assert content["counts"]["look-at"] == 1 and content["counts"]["waiting"] == 0
    assert page_content(ROWS, "x", counts={"done": 9})["total"] == 9


def test_the_table_is_parquet_as_well(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    write_summary(tmp_path, ROWS, "x")
    rows = parquet.read_table(tmp_path / "objects.parquet").to_pylist()
    assert [row["confidence"] for row in rows] == [0.9, 0.5, 0.8, None]
    assert rows[2]["reason"] == "=HYPERLINK()" and rows[0]["id"] == 1
