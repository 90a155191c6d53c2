"""`nrdf retrieve`: what it writes, says and refuses, on whole clouds and on scans."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from builders.scenes import pose, yaw_error
from builders.taught_box import cloud
from nrdf import cli
from nrdf.bundled import bundled_chair
from nrdf.field.zoo import list_models
from nrdf.geometry.similarity import Similarity
from nrdf.io.cloud import read_cloud, write_cloud
from nrdf.io.ply import read_header, read_scalars
from nrdf.io.result_folder import MANIFEST

SHARED_SCAN = Path(__file__).parents[3] / "shared" / "scans" / "chair-2.off"


PLACE = pose(1.1, 850.0, (100, 2000, -30))


def run(*words) -> int:
    return cli.run([str(word) for word in words])


def similarity(report) -> Similarity:
    matrix = np.array(report["T_scan_canonical"])
    return Similarity(matrix[:3, :3], matrix[:3, 3], report["scale"])


@pytest.mark.parametrize("method", ["mask", "points"])
def test_retrieve_answers_in_the_targets_own_coordinates(retrieve, chair_files, tmp_path, method):
    assert retrieve(method=[method]) == 0
    out = tmp_path / "deep" / "result"
    report = json.loads((out / "report.json").read_text())
    assert {p.name for p in out.iterdir()} == {MANIFEST, *report["files"]}
    assert set(report["files"]) == {"seat.ply", "legs.ply", "picture.png", "report.json"}
    assert report["method"] == method
    assert report["model"]["preset"] == "default"
    assert report["target"]["unit"] == "mm" and report["reference"]["unit"] == "m"
    assert {"normals", "embed", "map", "associate"} <= set(report["seconds"]["of the target"])
    target = read_cloud(chair_files / "target.ply")
    for name in ("seat", "legs"):
        found = read_cloud(out / f"{name}.ply")
        columns = read_scalars(out / f"{name}.ply", read_header(out / f"{name}.ply"))
        assert len(found) == report["regions"][name]["points"] > 0
        np.testing.assert_allclose(found.points, target.points[columns["index"].astype(int)])
        assert (columns["confidence"] >= 0).all() and (columns["confidence"] <= 1).all()
        assert columns["confidence"].mean() == pytest.approx(
            report["regions"][name]["mean_confidence"], abs=1e-3
        )
        assert {"red", "green", "blue"} <= set(columns)
        assert (found.unit, found.frame) == ("mm", "cell")


def test_what_is_not_there_comes_back_empty_with_the_reason(
    retrieve, chair_files, tmp_path, capsys
):
    assert retrieve(target=[chair_files / "other.ply"]) == 0
    out = tmp_path / "deep" / "result"
    seat = json.loads((out / "report.json").read_text())["regions"]["seat"]
    assert (seat["points"], seat["reason"]) == (0, "not observed") and seat["centre"] is None
    assert seat["share_observed"] < 0.2 and 0.5 < seat["confidence_of_presence"] <= 1
    assert read_header(out / "seat.ply").count("vertex") == 0
    assert "region 'seat': not observed (confidence 0." in capsys.readouterr().err
    words = {"target": [chair_files / "other.ply"], "region": [chair_files / "seat.ply"]}
    assert retrieve(**words, overwrite=[]) == 4
    said = capsys.readouterr().err
    assert "none of the regions was found" in said and "try --up z" in said
    assert (out / "report.json").exists() and not (out / "legs.ply").exists()


def test_full_folder_is_refused_before_anything_is_computed(retrieve, tmp_path, capsys):
    out = tmp_path / "deep" / "result"
    out.mkdir(parents=True)
    (out / "mine.txt").write_text("mine")
    assert retrieve(model=["no-such-model"]) == 2
    assert "not empty" in capsys.readouterr().err
    assert cli.run(["demo", "--out", str(out)]) == 2


def test_overwrite_keeps_what_is_not_ours(retrieve, tmp_path):
    out = tmp_path / "deep" / "result"
    out.mkdir(parents=True)
    (out / "mine.txt").write_text("mine")
    assert retrieve(overwrite=[]) == 0
    assert (out / "mine.txt").exists() and (out / "seat.ply").exists()


def bad_regions(chair_files):
    reference, _ = bundled_chair("reference")
    np.save(chair_files / "far.npy", reference.points[:50] + np.array([1.0, 0.0, 0.0]))
    np.save(chair_files / "empty.npy", np.zeros(8192, bool))
    np.save(chair_files / "short.npy", np.ones(77, bool))
    np.savez(chair_files / "evil.npz", **{"../../evil": np.ones(8192, bool)})
    (chair_files / "text.npy").write_text("no array")
    (chair_files / "void.ply").write_text("")
    return {
        "far.npy": "not on the reference",
        "empty.npy": "False everywhere",
        "short.npy": "8192 points",
        "evil.npz": "no name for a region",
        "text.npy": "cannot read the region file",
        "void.ply": "empty",
        "missing.ply": "missing.ply",
    }


@pytest.mark.parametrize(
    "name",
    ["far.npy", "empty.npy", "short.npy", "evil.npz", "text.npy", "void.ply", "missing.ply"],
)
def test_bad_region_is_named_and_nothing_is_left_behind(
    retrieve, chair_files, tmp_path, capsys, name
):
    message = bad_regions(chair_files)[name]
    assert retrieve(region=[chair_files / "seat.ply", chair_files / name]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert message in said
    assert "Traceback" not in said
    assert list(tmp_path.iterdir()) == []


def test_two_regions_of_one_name_are_refused(retrieve, chair_files, capsys):
    assert retrieve(region=[chair_files / "seat.ply", chair_files / "seat.ply"]) == 2
    assert "two regions are called 'seat'" in capsys.readouterr().err


def test_unknown_model_lists_the_known(retrieve, tmp_path, capsys):
    assert retrieve(model=["chiar"]) == 2
    said = capsys.readouterr().err
    assert "no model 'chiar'; did you mean 'chair'? " in said
    assert all(entry.name in said for entry in list_models())
    assert list(tmp_path.iterdir()) == []


def test_ctrl_c_ends_with_130_and_leaves_nothing(retrieve, tmp_path, monkeypatch):
    def interrupted(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr("nrdf.viz.picture.draw_regions", interrupted)
    assert retrieve() == 130
    assert list(tmp_path.iterdir()) == []


def test_unexpected_errors_keep_their_traceback(retrieve, tmp_path, monkeypatch):
    def broken(*arguments):
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr("nrdf.viz.picture.draw_regions", broken)
    with pytest.raises(ZeroDivisionError):
        retrieve()
    assert list(tmp_path.iterdir()) == []


def test_retrieve_takes_a_scan_and_answers_in_its_frame(scans, tmp_path):
    out = tmp_path / "result"
    assert run("retrieve", "--model", "chair", "--reference", scans / "ref.ply", "--region",
               scans / "regions.npz", "--target", scans / "scan.ply", "--up", "z",
               "--unit", "mm", "--out", out) == 0  # fmt: skip
    report = json.loads((out / "report.json").read_text())
    assert report["alignment"]["unit"] == {"name": "mm", "origin": "given"}
    assert yaw_error(similarity(report["alignment"]), PLACE) < 5
    scan = read_cloud(scans / "scan.ply")
    found = read_cloud(out / "seat.ply")
    columns = read_scalars(out / "seat.ply", read_header(out / "seat.ply"))
    np.testing.assert_allclose(scan.points[columns["index"].astype(int)], found.points)
    height = PLACE.to_canonical(found.points)[:, 1]
    assert len(found) > 300 and np.ptp(height) < 0.25
    assert report["regions"]["seat"]["reason"] is None
    assert report["target"]["points"] == len(scan)


def test_an_armless_chair_has_no_arms(scans, tmp_path, capsys):
    out = tmp_path / "result"
    assert run("retrieve", "--model", "chair", "--reference", scans / "armchair.ply", "--region",
               scans / "arms.npz", "--target", scans / "ref.ply", "--out", out) == 0  # fmt: skip
    regions = json.loads((out / "report.json").read_text())["regions"]
    assert regions["arm-left"]["reason"] == "absent" and regions["arm-left"]["points"] == 0
    assert regions["arm-left"]["confidence_of_presence"] > 0.5
    assert regions["seat"]["reason"] is None and regions["seat"]["points"] > 300
    assert "region 'arm-left': absent (confidence" in capsys.readouterr().err
    assert len(read_cloud(out / "seat.ply")) == regions["seat"]["points"]


def test_options_for_scans_need_up(scans, tmp_path, capsys):
    words = ["retrieve", "--model", "chair", "--reference", scans / "ref.ply", "--region",
             scans / "regions.npz", "--target", scans / "scan.ply"]  # fmt: skip
    assert run(*words, "--skip", "floor", "--out", tmp_path / "a") == 2
    assert "are for scans: give --up" in capsys.readouterr().err


@pytest.mark.skipif(not SHARED_SCAN.is_file(), reason="needs the real scan chair-2.off: any chair "
                    "from a depth sensor, z up, as ../shared/scans/chair-2.off")  # fmt: skip
def test_a_real_scan_goes_through(scans, tmp_path):
    shutil.copy(SHARED_SCAN, tmp_path / "chair.off")
    out = tmp_path / "result"
    assert run("retrieve", "--model", "chair", "--reference", scans / "ref.ply", "--region",
               scans / "regions.npz", "--target", tmp_path / "chair.off", "--up", "z", "--out", out
               ) == 0  # fmt: skip
    report = json.loads((out / "report.json").read_text())
    best = similarity(report["alignment"])
    assert 0.65 < best.scale < 0.75 and report["alignment"]["kind"]["fits"]
    assert report["alignment"]["probability"] > 0.9 and report["alignment"]["warnings"] == []
    seat, back, leg = (
        best.to_canonical(read_cloud(out / f"{name}.ply").points)
        for name in ("seat", "back-front", "leg-left-front")
    )
    assert len(seat) > 200 and (np.abs(seat[:, 1] - 0.08) < 0.06).mean() > 0.97
    assert (seat[:, 0] > 0.05).sum() > 120, "its middle was not seen, its front edge was"
    # One sheet was measured of the backrest; it is its front as well as its back.
    assert len(back) > 300 and np.quantile(back[:, 0], 0.95) < -0.15
    assert np.ptp(np.quantile(back[:, 1], [0.1, 0.9])) > 0.25 and np.ptp(back[:, 2]) > 0.5
    assert (leg[:, 0] > 0.1).all() and (leg[:, 2] < -0.2).all(), "a sitter's left is -Z"
    assert leg[:, 1].min() < -0.45 and np.quantile(leg[:, 1], 0.95) < 0.1


def test_regions_that_would_be_one_file_are_refused(tmp_path, capsys):
    whole = cloud()
    np.savez(tmp_path / "two.npz", Seat=np.arange(9), seat=np.arange(9))
    np.savez(tmp_path / "device.npz", nul=np.arange(9))

    write_cloud(tmp_path / "box.ply", whole)
    for file, message in (("two", "would be one file"), ("device", "Windows keeps nul")):
        words = f"retrieve --model chair --reference {tmp_path}/box.ply --region "
        words += f"{tmp_path}/{file}.npz --target {tmp_path}/box.ply --out {tmp_path}/out"
        assert cli.run(words.split()) == 2
        assert message in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "out").exists()
