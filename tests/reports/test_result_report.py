"""What a report says of a result."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from nrdf.process.process import Process
from nrdf.process.result_target import plan_result
from nrdf.process.strategy import strategy_of
from nrdf.process.transfer_result import PathResult
from nrdf.process_model.cells import plate
from nrdf.reports.result_report import histogram, result_content, result_heat_maps, result_lines
from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.mesh_planner import plan_on_mesh

PAINT = {
    "kind": "paint", "stepover_mm": 40, "standoff_mm": 150, "feed_mm_s": 300,
    "thickness_um": "60 ± 6",
    "tool": {"radius_mm": 50, "profile": {"across_mm": 50, "along_mm": 40, "flow_mm3_s": 400}},
}  # fmt: skip


@pytest.fixture(scope="module")
def step():
    mesh = plate(0.4, 0.3, 0.05)
    region = RegionMesh.from_faces(mesh, np.ones(len(mesh.faces), bool))
    process = Process.model_validate(PAINT)
    made = plan_result(region, process, plan_on_mesh(region, strategy_of(process)), True)
    return PathResult("seat", 0, process, "replan", result=made)


def test_a_result_is_told_in_figures_and_words(step):
    content = result_content(step, np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0]))
    assert content["planned"]["within"] > content["taught"]["within"]
    told = dict(result_lines(content))
    assert told["film wanted"] == "60 ± 6 µm"
    assert "µm" in told["worst places"] and "overspray, planned · at one feed" in told


def test_a_heat_map_and_its_histogram(step):
    surface = plate(0.4, 0.3, 0.05)
    (drawn,) = result_heat_maps(SimpleNamespace(paths=[step], pose=None, surface=surface))
    rows = histogram(drawn.shares, 60e-6, 6e-6)
    assert rows[0][0] == "below 42" and rows[4][0] == "57 to 63" and rows[-1][0] == "above 78"
    assert sum(share for _, share, _ in rows) == pytest.approx(1.0)
    assert sum(share for _, share, _ in rows[3:6]) > 0.95


def test_a_process_without_a_target_has_no_result():
    plain = {k: v for k, v in PAINT.items() if k != "thickness_um"}
    step = PathResult("seat", 0, Process.model_validate(plain), "replan")
    assert result_content(step, np.eye(3)[1], np.eye(3)[0]) is None
    assert result_heat_maps(SimpleNamespace(paths=[step], pose=None, surface=None)) == [None]
