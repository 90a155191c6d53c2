"""The table of methods, pairs and regions."""

from __future__ import annotations

import json

import numpy as np
import pytest

from bsrc_folder import member_clouds, write_bsrc
from nrdf.benchmark.bsrc import ROIS, read_bsrc
from nrdf.benchmark.evaluate import MISSED, PUBLISHED, evaluate, table, write_results
from nrdf.benchmark.methods import get_method
from nrdf.benchmark.metrics import chamfer_l1
from nrdf.errors import OutputError


@pytest.fixture(scope="module")
def objects(tmp_path_factory):
    root = tmp_path_factory.mktemp("bsrc")
    return read_bsrc(write_bsrc(root, "chair", member_clouds("chair", (0, 1, 2))), "chair")


@pytest.fixture(scope="module")
def copy(objects):
    return evaluate("copy", get_method("copy"), objects, "chair")


def test_copying_to_an_identical_object_costs_nothing(tmp_path):
    clouds = member_clouds("car", (2, 2))
    same = read_bsrc(write_bsrc(tmp_path, "car", clouds), "car")
    result = evaluate("copy", get_method("copy"), same, "car")
    assert result.distance.shape == (2, 8) and result.mean == pytest.approx(0, abs=1e-9)


def test_every_pair_and_region_has_its_distance(objects, copy):
    assert copy.pairs[:3] == [("chair1", "chair2"), ("chair1", "chair3"), ("chair2", "chair1")]
    assert copy.distance.shape == (6, 8) and copy.rois == ROIS["chair"]
    assert copy.seconds.shape == (6,) and (copy.seconds > 0).all()
    assert copy.mean == pytest.approx(copy.distance.mean()) and copy.mean > 0.01
    first, _, third = objects
    found = get_method("copy")(first, third)["2f"]
    expected = chamfer_l1(third.cloud.points[found], third.regions["2f"])
    assert copy.distance[1, ROIS["chair"].index("2f")] == pytest.approx(expected)


def test_a_region_found_nowhere_is_counted_as_missed(objects):
    nothing = np.zeros(0, int)

    def method(reference, target):
        everything = np.arange(len(target.cloud))
        return {roi: nothing if roi == "3" else everything for roi in reference.regions}

    told = []
    result = evaluate("mine", method, objects, "chair", lambda *a: told.append(a))
    assert (result.distance[:, ROIS["chair"].index("3")] == MISSED).all()
    assert (result.distance < MISSED).sum() == 6 * 7
    assert told == [(i, 6) for i in range(1, 7)]


def test_the_table_has_a_row_for_each_method_and_for_what_is_published(copy):
    lines = table([copy, copy], "chair").splitlines()
    assert len(lines) == 2 + 2 + 3
    assert (
        lines[0] == "| chair: CD-L1 | 1 | 2b | 2f | 3 | 5b | 5r | 7b | 7r | **mean** | s a pair |"
    )
    assert f"| **{copy.mean:.4f}** |" in lines[2] and "snapped" in lines[2]
    assert [cell.strip() for cell in lines[2].split("|")[2:10]] == [
        f"{value:.3f}" for value in copy.distance.mean(0)
    ]
    assert "published NRDF (all 90 pairs)" in lines[-1] and "0.039" in lines[-1]
    assert {line.count("|") for line in lines} == {12}


def test_results_are_written_with_their_convention(copy, tmp_path):
    write_results([copy], "chair", "corrected", tmp_path / "new" / "results")
    folder = tmp_path / "new" / "results"
    assert sorted(path.name for path in folder.iterdir()) == [
        "table2-chair-corrected.json",
        "table2-chair-corrected.md",
    ]
    markdown = (folder / "table2-chair-corrected.md").read_text()
    assert markdown == table([copy], "chair") + "\n"
    content = json.loads((folder / "table2-chair-corrected.json").read_text())
    assert content["convention"].startswith("Manhattan") and "summed" in content["convention"]
    assert (content["labels"], content["published_mean"]) == ("corrected", PUBLISHED["chair"])
    pairs = content["methods"]["copy"]["pairs"]
    assert (pairs[1]["reference"], pairs[1]["target"]) == ("chair1", "chair3")
    np.testing.assert_allclose([pair["cd_l1"] for pair in pairs], copy.distance, atol=1e-6)


def test_a_place_that_cannot_be_written_is_refused(copy, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match=r"cannot make .*file"):
        write_results([copy], "chair", "published", tmp_path / "file")
