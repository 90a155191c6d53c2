"""`nrdf eval process`."""

from __future__ import annotations

from nrdf.cli import run
from nrdf.io.ply import write_ply_mesh
from nrdf.process_model.cells import plate


def test_a_mesh_is_evaluated(tmp_path, capsys):
    mesh = plate(0.6, 0.3, 0.1)
    write_ply_mesh(tmp_path / "sheet.ply", mesh.vertices, mesh.faces, [])
    assert run(["eval", "process", "--meshes", str(tmp_path / "sheet.ply"), "--each"]) == 0
    said = capsys.readouterr().out
    assert "flat plate of 0.5 m" in said and "seconds for 10,000 cells" in said
