"""What is summed up of pairs of labelled objects."""

from __future__ import annotations

import csv
import io

import pytest

from builders.pair_results import RESULTS, SETS, pair, part
from nrdf_benchmark.objects.report import Report
from nrdf_benchmark.objects.retrieval import Pose
from nrdf_benchmark.objects.table import (
    Count,
    cells,
    difference_of,
    headings,
    is_skipped,
    poses_of,
    rows_of,
    to_csv,
)


def test_means_are_over_parts_that_both_have_and_counts_of_what_is_skipped():
    nrdf, registration = rows_of(RESULTS, SETS)
    assert nrdf.iou == {"seat": (pytest.approx(0.6), 2), "leg": (0, 1)}
    assert nrdf.mean == pytest.approx(0.4) and nrdf.plain == pytest.approx(0.4)
    assert nrdf.told == Count(1, 3) and nrdf.skipped == Count(2, 3)
    assert nrdf.absent == Count(2, 3) and nrdf.hidden == Count(0, 0)
    assert registration.mean == pytest.approx(2 / 3) and registration.plain == pytest.approx(0.7)
    assert registration.told is registration.absent is None
    assert str(Count(1, 3)) == "33% (1/3)" and str(Count(0, 0)) == ""


def test_a_row_is_brief_on_a_terminal():
    row = rows_of(RESULTS, SETS)[0]
    full, brief = (cells(row, ["seat", "leg", "arm"], brief) for brief in (False, True))
    assert full[:4] == ["0.600", "0.000", "", "0.400"] and full[-3] == "33% (1/3)"
    assert brief[:4] == ["0.60", "0.00", "", "0.400"] and brief[-3] == "33%"
    assert len(full) == len(brief) == len(headings(["seat", "leg", "arm"]))


def test_sets_and_views_have_rows_of_their_own():
    seen = pair("nrdf", "a/1", "a/2", part("leg", "hidden", score=0.0), views=1)
    rows = rows_of([*RESULTS, seen], {**SETS, "b": [("a/1", "a/2")], "none": []})
    assert [(r.set, r.views, r.method, r.pairs) for r in rows] == [
        ("a", 0, "nrdf", 2), ("a", 0, "registration", 2), ("a", 1, "nrdf", 1),
        ("b", 0, "nrdf", 1), ("b", 0, "registration", 1), ("b", 1, "nrdf", 1),
    ]  # fmt: skip
    assert rows[2].hidden == Count(1, 1) and rows[2].mean != rows[2].mean


def test_skipped_is_what_a_transfer_leaves_out():
    assert is_skipped(part("a", reason="absent", score=0.0))
    assert is_skipped(part("a", score=0.24)) and not is_skipped(part("a", score=0.25))


def test_the_interval_is_of_targets_drawn_anew():
    results = []
    for target in range(40):
        for reference in range(3):
            better = 0.1 if target % 2 else 0.3
            for method, iou in (("nrdf", 0.4 + better), ("registration", 0.4)):
                names = f"a/r{reference}", f"a/{target}"
                results.append(pair(method, *names, part("seat", iou=iou)))
    (row, _) = rows_of(results, {"a": [(f.reference, f.target) for f in results]})
    found = difference_of(results, row)
    assert found.mean == pytest.approx(0.2) and found.targets == 40
    # The mean of 40 draws of 0.1 or 0.3: standard deviation 0.1 / sqrt(40).
    assert found.low == pytest.approx(0.2 - 1.96 * 0.0158, abs=0.004)
    assert found.high == pytest.approx(0.2 + 1.96 * 0.0158, abs=0.004)
    assert difference_of([f for f in results if f.method == "nrdf"], row) is None
    few = [f for f in results if f.target in [f"a/{i}" for i in range(4)]]
    assert difference_of(few, row) is None
    report = Report(results, {"a": [(f.reference, f.target) for f in results]})
    assert "a, whole: nrdf less registration +0.200 mean part IoU (95 %: +0.1" in report.lines()[0]


def test_poses_count_each_target_once_and_fronts_only_where_they_are_known():
    poses = {"a/1": Pose(2.0, 0.01, False, 1.0), "a/2": Pose(180.0, 0.02, True, 2.0)}
    poses["a/3"] = Pose(None, 0.03, False, 3.0)
    results = [
        pair(method, "a/0", target, views=1, pose=pose)
        for method in ("nrdf", "registration")
        for target, pose in poses.items()
    ]
    (row, _) = rows_of(results, {"a": [("a/0", target) for target in poses]})
    found = poses_of(results, row)
    assert found.right == Count(1, 2) and found.warned == Count(1, 1)
    assert found.scale == 0.02 and found.seconds == 2.0
    assert poses_of(RESULTS, rows_of(RESULTS, SETS)[0]) is None


def test_every_part_has_a_line():
    rows = list(csv.DictReader(io.StringIO(to_csv(RESULTS))))
    assert len(rows) == 10
    assert rows[1]["reason"] == "absent" and rows[1]["skipped"] == "true"
    assert rows[3]["iou"] == "" and rows[0]["evidence"] == "1 2"
    assert rows[-1]["reference_mixed"] == "0.2000" and rows[-1]["score"] == ""
