"""`nrdf eval scans` as a user runs it."""

from __future__ import annotations

import json

from nrdf import cli


def test_the_command_scores_meshes_and_writes_every_figure(tmp_path, capsys):
    import trimesh

    body = trimesh.util.concatenate([
        trimesh.creation.box((1.0, 0.15, 0.4)),
        trimesh.creation.box((0.5, 0.15, 0.35), trimesh.transformations.translation_matrix(
            (-0.1, 0.15, 0))),
    ])  # fmt: skip
    (tmp_path / "car").mkdir()
    body.export(tmp_path / "car" / "box-car.ply")
    (tmp_path / "index.csv").write_text("category,shape,split\ncar,box-car,test\ncar,other,train\n")
    out = tmp_path / "scans.json"
    words = ["eval", "scans", "--category", "car", "--members", "0", "--pairs", "0", "--meshes",
             str(tmp_path), "--out", str(out)]  # fmt: skip
    assert cli.run(words) == 0
    assert "mesh: yaw within 5°" in capsys.readouterr().out
    content = json.loads(out.read_text())
    assert [p["name"] for p in content["poses"]] == ["box-car"] * 3
