"""`nrdf model prepare`."""

from __future__ import annotations

import trimesh

from nrdf import cli


def test_prepare_names_what_it_cannot_use_and_goes_on(tmp_path, capsys):

    meshes = tmp_path / "meshes"
    meshes.mkdir()
    trimesh.creation.box((0.5, 1.0, 0.7)).export(meshes / "box.ply")
    (meshes / "broken.obj").write_text("f 1 2 3")
    words = f"model prepare {meshes} --category chair --out {tmp_path}/data --workers 1 "
    words += "--surface-points 500 --queries 500"
    for made, kept in ((1, 0), (0, 1)):
        assert cli.run(words.split()) == 1
        said = capsys.readouterr()
        assert f"{made} shapes made, {kept} were there already" in said.out
        assert "not used: broken.obj: " in said.err
    (meshes / "broken.obj").unlink()
    assert cli.run(words.split()) == 0
    assert cli.run(["model", "prepare", str(tmp_path / "none"), *words.split()[3:]]) == 2
