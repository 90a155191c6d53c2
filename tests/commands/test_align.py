"""`nrdf align`: what it writes, says and refuses."""

from __future__ import annotations

import json

import numpy as np
import pytest

from builders.scenes import pose, yaw_error
from nrdf import cli
from nrdf.geometry.canonical import rotation_about_up
from nrdf.geometry.similarity import Similarity, up_axis, upright
from nrdf.io.cloud import PointCloud, read_cloud, write_cloud
from nrdf.io.ply import read_header, read_scalars
from nrdf.io.result_folder import MANIFEST

PLACE = pose(1.1, 850.0, (100, 2000, -30))


def run(*words) -> int:
    return cli.run([str(word) for word in words])


def similarity(report) -> Similarity:
    matrix = np.array(report["T_scan_canonical"])
    return Similarity(matrix[:3, :3], matrix[:3, 3], report["scale"])


def test_align_writes_pose_object_and_picture(scans, tmp_path, capsys):
    out = tmp_path / "aligned"
    assert run("align", scans / "scan.ply", "--model", "chair", "--up", "z", "--out", out) == 0
    report = json.loads((out / "report.json").read_text())
    assert {p.name for p in out.iterdir()} == {MANIFEST, *report["files"]}
    assert set(report["files"]) == {"aligned.ply", "object.ply", "picture.png", "report.json"}
    found = similarity(report)
    assert yaw_error(found, PLACE) < 5 and found.scale == pytest.approx(850, rel=0.03)
    assert report["unit"] == {"name": "mm", "origin": "guessed"} and report["warnings"] == []
    assert [step["name"] for step in report["cleaning"]][:3] == ["thin", "duplicates", "floor"]
    kept, aligned = read_cloud(out / "object.ply"), read_cloud(out / "aligned.ply")
    np.testing.assert_allclose(found.to_scan(aligned.points), kept.points, atol=1e-3)
    columns = read_scalars(out / "object.ply", read_header(out / "object.ply"))
    scan = read_cloud(scans / "scan.ply")
    np.testing.assert_allclose(scan.points[columns["index"].astype(int)], kept.points)
    assert "850" in (shown := capsys.readouterr().out) or "mm (guessed)" in shown


def test_strict_ends_with_3_where_there_is_doubt(scans, tmp_path, capsys):
    words = ["align", scans / "scan.ply", "--model", "car", "--up", "z"]
    assert run(*words, "--out", tmp_path / "a") == 0
    said = capsys.readouterr().err
    assert "does not look like a car" in said
    assert run(*words, "--strict", "--out", tmp_path / "b") == 3
    assert (tmp_path / "b" / "report.json").is_file()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["floor.ply", "--up", "z"], "the step 'floor' removed 3000"),
        (["scan.ply", "--up", "w"], "'w' is no direction; give one of x, y, z"),
        (["scan.ply", "--up", "z", "--sensor", "1", "2"], "--sensor has 2 numbers"),
        (["none.ply", "--up", "z"], "No such file"),
    ],
)
def test_what_align_refuses(scans, tmp_path, capsys, options, message):
    words = ["align", scans / options[0], *options[1:], "--model", "chair"]
    assert run(*words, "--out", tmp_path / "a") == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "a").exists()


def test_up_may_begin_with_a_dash(scans, tmp_path, capsys):
    assert cli._with_axes_joined(["align", "--up", "-y", "--out", "-z"]) == [
        "align", "--up=-y", "--out", "-z"
    ]  # fmt: skip
    turned = Similarity(upright(up_axis("-x")) @ rotation_about_up(0.3), np.zeros(3), 1.0)
    cloud = read_cloud(scans / "ref.ply")
    write_cloud(tmp_path / "t.ply", PointCloud(turned.to_scan(cloud.points)))
    out = tmp_path / "a"
    assert run("align", tmp_path / "t.ply", "--model", "chair", "--up", "-x", "--out", out) == 0
    assert yaw_error(similarity(json.loads((out / "report.json").read_text())), turned) < 3
