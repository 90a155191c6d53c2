"""Film on real meshes."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.process_model.cells import plate
from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.target_mesh import TargetMesh
from nrdf.toolpath.strategy import Strategy
from nrdf_benchmark.process_results import (
    evaluate_plate,
    evaluate_region,
    fits,
    is_curved,
    summary,
)


def whole(mesh):
    return RegionMesh.from_faces(mesh, np.ones(len(mesh.faces), bool))


def test_the_flat_plate_meets_its_bar():
    found = evaluate_plate()
    assert found.planned < 0.03 and found.theory < 0.03


def test_a_bent_plate_is_told_from_a_flat_one_and_measured_in_both_ways():
    flat = plate(0.5, 0.3, 0.025)
    bent = flat.vertices + np.outer(0.02 * np.cos(12.0 * flat.vertices[:, 0]), [0, 0, 1])
    region = whole(TargetMesh(bent, flat.faces))
    assert is_curved(region) and not is_curved(whole(flat))
    strategy = Strategy(tool_radius_m=0.05, spacing_m=0.01)
    result = evaluate_region(region, "plate", "all", strategy)
    assert result.planned.within > result.taught.within + 0.2
    rows = summary([result])
    assert [row[0].split(",")[0] for row in rows][:2] == ["area within ± 10 %", "variation"]


def test_a_footprint_fits_or_does_not():
    assert fits(whole(plate(0.3, 0.12, 0.02)), 0.05)
    assert not fits(whole(plate(0.5, 0.06, 0.02)), 0.05)
    assert summary([]) == [] or pytest.fail("no regions, no rows")
