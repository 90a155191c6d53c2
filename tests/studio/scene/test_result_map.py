"""Film on a target, in colours."""

from __future__ import annotations

import re

import numpy as np
import pytest

from nrdf.process.process import Process
from nrdf.process.result_target import plan_result
from nrdf.process.strategy import strategy_of
from nrdf.process_model.cells import plate
from nrdf.studio.model.computed import LeftResult
from nrdf.studio.scene.result_map import result_legend, result_meshes
from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.mesh_planner import plan_on_mesh
from nrdf.viz.heat_map import COLOURS

PAINT = Process.model_validate({
    "kind": "paint", "thickness_um": "60 ± 6", "stepover_mm": 40, "standoff_mm": 150,
    "feed_mm_s": 250,
    "tool": {"radius_mm": 50, "profile": {"across_mm": 50, "along_mm": 50, "flow_mm3_s": 400}},
})  # fmt: skip


@pytest.fixture(scope="module")
def left():
    mesh = plate(0.3, 0.2, 0.05)
    region = RegionMesh.from_faces(mesh, np.ones(len(mesh.faces), bool))
    taught = plan_on_mesh(region, strategy_of(PAINT))
    result = plan_result(region, PAINT, taught, False)
    return LeftResult.of("<top>", PAINT, result)


def test_every_face_has_the_colour_of_its_film(left):
    meshes = result_meshes([left])
    fine = left.mesh
    assert sum(len(mesh.faces) for mesh, _ in meshes.values()) == len(fine.faces)
    corners = np.concatenate([mesh.vertices[mesh.faces] for mesh, _ in meshes.values()])
    order = np.lexsort(corners.mean(axis=1).T)
    whole = fine.vertices[fine.faces]
    np.testing.assert_array_equal(corners[order], whole[np.lexsort(whole.mean(axis=1).T)])
    assert len({tuple(colour) for _, colour in meshes.values()}) == len(meshes) > 1


def test_the_legend_says_how_much_is_within_and_hides_no_markup(left):
    html = result_legend("plate", [left])
    assert f"{left.within:.1%} has the film wanted, 60 ± 6 µm" in html
    assert "&lt;top&gt;" in html and "<top>" not in html
    assert html.count("background:") == len(COLOURS)
    shares = [float(found) for found in re.findall(r"</span>([\d.]+)%", html)]
    assert sum(shares) == pytest.approx(100.0, abs=0.5)
    assert result_legend("plate", []) == "" and LeftResult.of("legs", PAINT, None) is None
