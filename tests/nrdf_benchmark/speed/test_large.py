"""What large targets of the speed table are."""

import nrdf
from nrdf_benchmark.speed.large import KINDS, write_large


def test_large_targets_are_as_large_as_the_table_says(tmp_path):
    sizes = {kind: write_large(kind, tmp_path / f"{kind}.ply") for kind in KINDS}
    assert 90_000 <= sizes["mesh"] <= 180_000 and sizes["scan"] == 1_000_000
    mesh = nrdf.read_cloud(tmp_path / "mesh.ply", 1000)
    assert 0.99 * sizes["mesh"] < len(mesh.mesh.faces) <= sizes["mesh"]
    scan = nrdf.read_cloud(tmp_path / "scan.ply")
    assert len(scan) == sizes["scan"] and scan.mesh is None
