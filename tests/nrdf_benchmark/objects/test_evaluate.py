"""`nrdf eval objects`: results of pairs, and what is cache of them."""

from __future__ import annotations

import csv
from dataclasses import asdict, replace
from pathlib import Path

import pytest

from builders.labelled_boxes import IKEA, write_objects
from nrdf import cli
from nrdf.field.zoo import find_weights
from nrdf_benchmark.methods.registry import MethodSpec, find_methods
from nrdf_benchmark.objects.dataset import read_objects
from nrdf_benchmark.objects.evaluate import evaluate_objects, pairs_of
from nrdf_benchmark.objects.retrieval import Settings, shared_retrieval
from nrdf_benchmark.objects.table import rows_of
from nrdf_benchmark.result_cache import LineCache

BOX, REGISTRATION = MethodSpec("box-mask"), MethodSpec("registration")
POINTS = 1500


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    return write_objects(tmp_path_factory.mktemp("objects"))


@pytest.fixture(scope="module")
def settings(root):
    return Settings(root, find_weights("chair"), POINTS)


def by_part(result):
    return {part.part: part for part in result.parts}


def test_parts_are_found_and_scored_by_every_kind_of_method(settings):
    for spec in find_methods(["nrdf", "registration", "box-mask"], "chair"):
        result = shared_retrieval(settings).run(spec, 0, "chair/low", "chair/high")
        parts = by_part(result)
        assert set(parts) == {"seat", "back", "leg"} and result.pose is None
        for part in parts.values():
            assert part.state == "there" and part.iou > 0.6, (spec.name, part)
            assert (part.score is not None) == (spec.name == "nrdf")
        lacking = by_part(shared_retrieval(settings).run(spec, 0, "chair/low", "stool/plain"))
        assert (lacking["back"].state, lacking["back"].iou) == ("absent", None)
    assert "back" not in by_part(
        shared_retrieval(settings).run(spec, 0, "stool/plain", "chair/low")
    )


def test_what_absence_was_told_by_is_kept(settings):
    (spec,) = find_methods(["nrdf"], "chair")
    back = by_part(shared_retrieval(settings).run(spec, 0, "chair/high", "stool/plain"))["back"]
    assert back.reason == "absent" and back.confidence > 0.5 and len(back.evidence) >= 2
    assert (back.found, back.score) == (0, 0)


def test_what_was_measured_is_not_measured_again(settings, root, tmp_path, monkeypatch):
    objects = read_objects(root)
    pairs = pairs_of(objects, ["chair", "stool"])

    def run(cache, **changed):
        told = []
        results = evaluate_objects(
            replace(settings, **changed), objects, pairs, [BOX], cache=cache,
            progress=lambda *words: told.append(words),
        )  # fmt: skip
        return results, told[0][1]

    first, there = run(LineCache(tmp_path))
    assert there == 0 and [(f.reference, f.target) for f in first] == pairs
    again, there = run(LineCache(tmp_path))
    assert there == 6 and [asdict(f) for f in again] == [asdict(f) for f in first]
    path = next((tmp_path / "pairs").iterdir())
    path.write_text(path.read_text()[:-20])
    assert run(LineCache(tmp_path))[1] == 5
    assert run(LineCache(tmp_path), points=POINTS + 1)[1] == 0
    monkeypatch.setattr("nrdf_benchmark.objects.evaluate.code_checksum", lambda sources: "other")
    assert run(LineCache(tmp_path))[1] == 0
    assert run(LineCache(tmp_path, overwrite=True))[1] == 0


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


@pytest.mark.skipif(not IKEA.is_dir(), reason=f"no labelled furniture in {IKEA}")
def test_real_furniture():
    settings = Settings(Path(IKEA), find_weights("chair"))
    pairs = [("chair/agam", "chair/mammut_1"), ("chair/sigurd", "chair/sundvik")]
    results = [shared_retrieval(settings).run(REGISTRATION, 0, *pair) for pair in pairs]
    (row,) = rows_of(results, {"chair+stool": pairs})
    assert row.iou["seat"][0] > 0.6 and row.iou["back"][0] > 0.9 and row.mean > 0.6
    assert row.told is None
