"""The benchmark of scans: its truth, its results, its command."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import nrdf
from nrdf.errors import DataError
from nrdf.regions.match import Match
from nrdf.regions.presence import ABSENT, Presence
from nrdf.scans.pose_scorer import PoseScorer
from nrdf_benchmark import scans


@pytest.fixture(scope="module")
def scorer():
    return PoseScorer(nrdf.load_model("car"))


def test_poses_of_an_item_are_scored_the_same_every_time(scorer):
    (item,) = scans.members("car", 1)
    results = [scans.score_pose(scorer, item, kind) for kind in ("full", "3 views")]
    assert [f.kind for f in results] == ["full", "3 views"]
    for result in results:
        assert result.yaw < 5 and result.scale < 0.03 and result.source == "family"
        assert result.seconds > 0 and result.processor_seconds > 0
    assert results[0].points == scans.CLOUD_POINTS < results[1].points
    again = scans.score_pose(scorer, item, "full")
    assert (again.yaw, again.scale) == (results[0].yaw, results[0].scale)


def test_regions_of_a_pair_are_scored_in_every_kind_of_scan(scorer):
    results = scans.score_regions(scorer, "car", 0)
    assert {f.kind for f in results} == {"canonical", *scans.KINDS}
    there = [f for f in results if f.state == "there"]
    assert all(np.isnan(f.cd_l1) == (f.state != "there") for f in results)
    full = {f.region: f.cd_l1 for f in there if f.kind == "full"}
    canonical = {f.region: f.cd_l1 for f in there if f.kind == "canonical"}
    assert set(full) == set(canonical) and max(canonical.values()) < 0.2
    assert np.mean(list(full.values())) < 1.5 * np.mean(list(canonical.values()))


def test_truth_is_there_absent_or_hidden():
    points = np.random.default_rng(0).random((1000, 3))
    labels = np.array(["seat"] * 400 + [""] * 400 + ["floor"] * 200)
    share = {"seat": 0.5, "arm": 0.0, "back": 0.2, "leg": 0.02}
    nothing = Match(
        np.empty(0, int), points[:1], np.empty(0), "mask", Presence(ABSENT, 0.9, 0.1, 0.0)
    )
    found = Match(np.arange(400), points[:1], np.ones(400), "mask")
    matches = {"seat": found, "arm": nothing, "back": nothing, "leg": nothing}
    results = {f.region: f for f in scans._compare("1 view", 3, matches, points, labels, share)}
    assert {name: f.state for name, f in results.items()} == {
        "seat": "there", "arm": "absent", "back": "hidden", "leg": "hidden"
    }  # fmt: skip
    assert results["seat"].cd_l1 == 0 and results["arm"].reason == ABSENT
    whole = [replace(results["seat"], kind="canonical", region=r, cd_l1=c)
             for r, c in (("seat", 0.02), ("back", 0.04))]  # fmt: skip
    every = [*results.values(), *whole]
    rows = {(kind, what): value for kind, what, value, _ in scans.summary([], every)}
    assert rows["canonical", "CD-L1"] == pytest.approx(0.03)
    assert rows["1 view", "CD-L1"] == 0 and rows["1 view", "the same regions canonical"] == 0.02
    assert rows["1 view", "absent, reported absent"] == 1
    assert rows["1 view", "not seen, returned empty"] == 1
    assert rows["1 view", "there, reported absent"] == 0


def test_poses_are_summed_up_by_kind_and_source():
    def result(yaw, source, warned):
        return scans.PoseResult("1 view", source, "", yaw, 0.01, warned, 1.0, 1.0, 10)

    poses = [result(1, "family", False), result(179, "family", True), result(2, "mesh", False)]
    rows = {(kind, what): value for kind, what, value, _ in scans.summary(poses, [])}
    assert rows["1 view", "family: yaw within 5°"] == 0.5
    assert rows["1 view", "mesh: yaw within 5°"] == 1
    assert rows["1 view", "wrong poses with a warning"] == 1
    assert rows["1 view", "right poses with a warning"] == 0


def test_an_index_that_names_what_is_not_there_is_refused(tmp_path):
    with pytest.raises(DataError, match="cannot read"):
        list(scans.meshes(tmp_path, "car"))
    (tmp_path / "index.csv").write_text("category,shape,split\ncar,gone,test\n")
    with pytest.raises(DataError, match="lists 'gone', but car/gone"):
        list(scans.meshes(tmp_path, "car"))
