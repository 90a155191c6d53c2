"""`nrdf model scan`: the scan and its truth are written together."""

from __future__ import annotations

import json

import numpy as np
import trimesh

from nrdf import cli
from nrdf.errors import OutputError
from nrdf.io.cloud import read_cloud
from nrdf.io.ply import read_header, read_scalars


def test_a_scan_over_its_own_mesh_is_refused(tmp_path, capsys):
    (tmp_path / "mesh.ply").write_text("precious")
    assert (
        cli.run(["model", "scan", str(tmp_path / "mesh.ply"), "--out", str(tmp_path / "mesh.ply")])
        == 2
    )
    assert "is read, and would be overwritten" in " ".join(capsys.readouterr().err.split())
    assert (tmp_path / "mesh.ply").read_text() == "precious"


def test_a_scan_and_its_truth_are_as_they_were_where_writing_fails(tmp_path, monkeypatch, capsys):

    trimesh.creation.box((0.5, 0.6, 0.9)).export(tmp_path / "box.ply")
    words = f"model scan {tmp_path}/box.ply --pixels 40 --out {tmp_path}/scan.ply".split()
    assert cli.run(words) == 0
    before = {p.name: p.read_bytes() for p in tmp_path.iterdir()}
    assert set(before) == {"box.ply", "scan.ply", "scan.json"}

    def full(*_):
        raise OutputError("cannot write scan.json: No space left on device")

    monkeypatch.setattr("nrdf.io.atomic.write_json", full)
    assert cli.run([*words, "--seed", "1"]) == 2
    assert {p.name: p.read_bytes() for p in tmp_path.iterdir()} == before


BALL = trimesh.creation.icosphere(4, 0.5)


def test_the_command_writes_the_scan_and_the_truth(tmp_path, capsys):
    BALL.export(tmp_path / "ball.ply")
    words = ["model", "scan", tmp_path / "ball.ply", "--out", tmp_path / "scan.ply", "--pixels", 40,
             "--views", 2, "--floor", "--scale", 10, "--offset", 1, 2, 3, "--unit", "mm",
             "--normals", "--yaw", 90]  # fmt: skip
    assert cli.run([str(word) for word in words]) == 0
    cloud = read_cloud(tmp_path / "scan.ply")
    truth = json.loads((tmp_path / "scan.json").read_text())
    assert cloud.unit == "mm" and cloud.normals is not None
    np.testing.assert_allclose(cloud.sensors, truth["sensors"], rtol=1e-6)
    columns = read_scalars(tmp_path / "scan.ply", read_header(tmp_path / "scan.ply"))
    floor = columns["face"] < 0
    assert floor.sum() == truth["points_of_floor"] > 0 and len(cloud) == truth["points"]
    np.testing.assert_allclose(cloud.points[floor, 2], 3 - 5.0, atol=1e-6)
    radius = np.linalg.norm(cloud.points[~floor] - [1, 2, 3], axis=1)
    assert np.abs(radius - 5).max() < 0.03
    matrix = np.array(truth["T_scan_mesh"])
    np.testing.assert_allclose(matrix[:3, :3] @ [0, 1, 0], [0, 0, 1], atol=1e-12)
    for options, message in (
        (["--scale", "0"], "--scale 0 must be above 0"),
        (["--views", "0"], "views 0"),
    ):
        given = [
            "model",
            "scan",
            str(tmp_path / "ball.ply"),
            "--out",
            str(tmp_path / "b.ply"),
            *options,
        ]
        assert cli.run(given) == 2
        assert message in capsys.readouterr().err
