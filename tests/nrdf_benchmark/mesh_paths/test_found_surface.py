"""What tool paths are planned on: the mesh, votes on it, a scan of it."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from nrdf_benchmark.mesh_paths import found_surface
from nrdf_benchmark.mesh_paths.found_surface import regions_on
from nrdf_benchmark.mesh_paths.targets import whole_target


@pytest.fixture
def half_box(monkeypatch):
    """A box of 1.05 m, whose top is a region."""
    monkeypatch.setattr(found_surface, "SCAN", replace(found_surface.SCAN, pixels=150))
    box = trimesh.creation.box((1.0, 0.4, 1.0))
    target = whole_target("box", np.asarray(box.vertices), np.asarray(box.faces), "0")
    target.regions["top"] = np.asarray(box.face_normals[:, 1] > 0.5)
    return target


@pytest.mark.parametrize("kind", ["mesh", "votes", "scan"])
def test_the_top_of_a_box_is_found_on_each_surface(half_box, kind):
    top = regions_on(half_box, kind)("top")
    assert top.area_m2 == pytest.approx(1.05**2, rel=0.08)
    assert (top.mesh.face_areas @ top.mesh.face_normals)[1] == pytest.approx(top.area_m2, rel=0.01)
    off = np.abs(top.mesh.vertices[:, 1] - 0.21)
    assert np.median(off) < (0.001 if kind == "scan" else 1e-9)
