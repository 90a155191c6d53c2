"""`nrdf eval objects` as a user runs it."""

from __future__ import annotations

import csv

import pytest

from builders.labelled_boxes import write_objects
from nrdf import cli

POINTS = 1500


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    return write_objects(tmp_path_factory.mktemp("objects"))


def test_the_command_prints_a_table_and_writes_every_part(root, tmp_path, capsys):
    words = f"eval objects --data {root} --out {tmp_path} --method box-mask --points {POINTS} "
    words += "--views 0 --jobs 0 "
    assert cli.run([*words.split(), "--workers", "1"]) == 0
    shown = capsys.readouterr().out
    assert shown.startswith("chair, stool: 6 ordered pairs, whole clouds")
    with open(tmp_path / "objects.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2 * (3 + 3) + 2 * 2
    assert {row["state"] for row in rows if row["part"] == "back"} == {"there", "absent"}
    assert cli.run([*words.split(), "--workers", "1", "--pairs", "2"]) == 0
    assert capsys.readouterr().out.startswith("chair, stool: 2 ordered pairs, whole clouds")
    mean = sum(float(row["iou"]) for row in rows if row["iou"]) / sum(1 for r in rows if r["iou"])
    assert f"{mean:.3f}" in shown


@pytest.mark.parametrize(
    "words, message",
    [
        ("--method nrdf-points", "no method for objects 'nrdf-points'; known: copy, box"),
        ("--views 0 -1", "--views -1 must be from 0 to 20"),
        ("--jobs -1", "--jobs -1 must be 0 or more"),
        ("--views 1 1", "each once"),
        ("--points 10", "--points 10 must be from 256 to"),
        ("--category sofa", "no category 'sofa'; known: chair, stool"),
        ("--model chiar", "chiar"),
    ],
)
def test_options_that_make_no_sense_are_named(root, tmp_path, capsys, words, message):
    out = tmp_path / "results"
    assert cli.run(f"eval objects --data {root} --out {out} {words}".split()) == 2
    assert message in " ".join(capsys.readouterr().err.split())
    assert not out.exists()
