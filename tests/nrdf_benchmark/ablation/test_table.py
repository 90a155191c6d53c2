"""Table III: what is scored, how, and what is written."""

from __future__ import annotations

import csv
import json
import shutil

import numpy as np
import pytest
import torch

import nrdf
from builders.bsrc_folder import member_clouds, write_bsrc
from builders.tiny_field import TinyField, balls, tiny_config
from nrdf.errors import DataError
from nrdf.shapes.families import get_family
from nrdf.training.dataset import ShapeDataset
from nrdf_benchmark.ablation import table as ablation_table
from nrdf_benchmark.ablation.table import (
    Ablation,
    Case,
    VariantResult,
    benchmark_scores,
    family_cases,
    score,
    validation_losses,
)
from nrdf_benchmark.ablation.training import OMITTED, SHARED
from nrdf_benchmark.bsrc.dataset import read_bsrc
from nrdf_benchmark.methods.learned import FieldMethod
from nrdf_benchmark.metrics import MISSED


def test_pairs_of_the_family_have_the_regions_that_both_members_have():
    cases = family_cases("chair", 2)
    names = set(get_family("chair").region_names)
    for case in cases:
        assert list(case.regions) == list(case.truth) and case.regions
        assert set(case.regions) < names
        for cloud, regions in ((case.reference, case.regions), (case.target, case.truth)):
            rows = {tuple(point) for point in cloud.points}
            assert all(tuple(p) in rows for part in regions.values() for p in part)
            assert min(len(part) for part in regions.values()) >= 64
    again = family_cases("chair", 1)[0]
    np.testing.assert_array_equal(again.reference.points, cases[0].reference.points)
    assert not np.array_equal(again.reference.points, again.target.points)
    with pytest.raises(DataError, match="0 pairs asked for"):
        family_cases("chair", 0)


def test_scores_are_means_over_the_pairs_by_region():
    cases = family_cases("chair", 2)
    drawn = np.random.default_rng(0).permutation(len(cases[0].target))[:200]

    def match(reference, regions, target):
        return {name: drawn[:0] if name == "seat" else drawn for name in regions}

    told = []
    found = score(match, cases, lambda *a: told.append(a))
    assert told == [(1, 2), (2, 2)] and found["seat"] == MISSED
    name = next(name for name in cases[0].regions if name != "seat")
    expected = []
    for case in cases:
        if name in case.truth:
            apart = np.abs(case.target.points[drawn, None] - case.truth[name]).sum(-1)
            expected.append(apart.min(1).mean() + apart.min(0).mean())
    assert found[name] == pytest.approx(np.mean(expected), abs=1e-9)


def test_scores_on_bsrc_are_those_of_the_evaluation_and_are_kept(tmp_path, untrained, monkeypatch):
    clouds = member_clouds("chair", (0, 1), 400)
    benchmark = read_bsrc(write_bsrc(tmp_path, "chair", clouds), "chair")
    (tmp_path / "run").mkdir()
    shutil.copyfile(untrained, tmp_path / "run/weights.safetensors")
    told = []
    found = benchmark_scores(benchmark, tmp_path / "run", progress=lambda *a: told.append(a[1:]))
    assert list(found) == list(benchmark.rois) and told == [(0, 2), (1, 2), (2, 2)]
    match = FieldMethod(nrdf.load_model(untrained), "points")
    cases = [Case(a.cloud, a.regions, b.cloud, b.regions) for a, b in benchmark.pairs]
    assert found == pytest.approx(score(match, cases))
    monkeypatch.setattr("nrdf_benchmark.bsrc.evaluate.run_pair", None)
    assert found == benchmark_scores(benchmark, tmp_path / "run")


def test_validation_losses_are_the_losses_on_unseen_shapes():
    torch.manual_seed(0)
    field = TinyField().eval()
    dataset = ShapeDataset(balls(2), tiny_config().data)
    found = validation_losses(field, dataset)
    assert list(found) == list(OMITTED) and found == validation_losses(field, dataset)
    pool = next(iter(dataset.plain().values()))
    chamfers = []
    for step in range(ablation_table.VALIDATION_STEPS):
        batch = pool.batch(2, seed=0, step=step)
        with torch.no_grad():
            z = field.embed(batch.points, batch.normals)
            k = field.describe(z, batch.clean_points, batch.clean_normals)
            cross = field.invert(z[[1, 0]], k).points
        pairs = zip(cross, batch.clean_points[[1, 0]], strict=True)
        chamfers += [
            (square := torch.cdist(a, b).square()).min(0).values.mean()
            + square.min(1).values.mean()
            for a, b in pairs
        ]
    assert found["cd"] == pytest.approx(float(torch.stack(chamfers).mean()), rel=1e-4)


def result(variant, mean, **changes):
    regions, validation = {"1": mean - 0.01, "2": mean + 0.01}, dict.fromkeys(OMITTED, 0.5)
    values = {"regions": regions, "validation": validation, "seconds": 60.0, "training": {}}
    return VariantResult(variant, **{**values, **changes})


def test_the_table_says_what_it_was_measured_on(tmp_path):
    found = Ablation(
        "chair", "short", "20 pairs", 90.0, [result("complete", 0.04), result("emd", 0.05)]
    )
    lines = found.table().splitlines()
    columns = "| chair, short schedule | **CD-L1** | published | CD loss | EMD loss |"
    assert lines[0].startswith(columns)
    assert lines[2].startswith("| all losses | **0.0400** | 0.039 | 0.5000 |")
    assert lines[3].startswith("| without EMD | **0.0500** | 0.223 |")
    assert lines[3].endswith("| 60 |")
    assert len({line.count("|") for line in lines[:4]}) == 1
    assert "by eq. 9, on 20 pairs: Manhattan" in lines[5] and "90 s" in lines[-1]
    found.write(tmp_path, {"seed": 7})
    assert (tmp_path / "table3.md").read_text() == found.table() + "\n"
    rows = list(csv.DictReader((tmp_path / "table3.csv").open()))
    assert [row["variant"] for row in rows] == ["complete", "emd"]
    assert float(rows[1]["cd_l1"]) == pytest.approx(0.05) and float(rows[1]["2"]) == 0.06
    content = json.loads((tmp_path / "table3.json").read_text())
    assert content["seed"] == 7 and content["variants"][1]["mean"] == pytest.approx(0.05)
    assert content["convention"].startswith("Manhattan")
    assert content["published"] == ablation_table.PUBLISHED["chair"]


def test_seeds_are_shown_as_their_mean_and_range(tmp_path):
    results = [
        result("complete", 0.04),
        result("complete", 0.05, seed=1, seconds=30.0),
        result("emd", 0.045),
        result("emd", 0.048, seed=1),
        result(SHARED, 0.06, seconds=0.0),
    ]
    found = Ablation("chair", "short", "20 pairs", 90.0, results)
    lines = found.table().splitlines()
    assert "| **CD-L1** | lowest to highest | above all losses, by seed | published |" in lines[0]
    assert lines[2].startswith("| all losses | **0.0450** | 0.0400 to 0.0500 |  | 0.039 | 0.5000 |")
    assert lines[2].endswith("| 45 |")
    assert "| **0.0465** | 0.0450 to 0.0480 | -0.0020 to +0.0050 | 0.223 |" in lines[3]
    assert lines[4].startswith("| without the last stage | **0.0600** |  |  |  | 0.5000 |")
    assert len({line.count("|") for line in lines[:5]}) == 1
    assert "Means of 2 seeds of the last stage" in found.table()
    found.write(tmp_path, {})
    rows = list(csv.DictReader((tmp_path / "table3.csv").open()))
    assert [(row["variant"], row["seed"]) for row in rows] == [
        ("complete", "0"),
        ("complete", "1"),
        ("emd", "0"),
        ("emd", "1"),
        (SHARED, "0"),
    ]


def test_a_category_that_the_paper_lacks_has_no_published_column():
    found = Ablation("table", "short", "20 pairs", 90.0, [result("complete", 0.04)])
    assert "published" not in found.table()
