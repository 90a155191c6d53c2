"""Cells of a region and of what lies around."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.process_model.cells import Cells, plate
from nrdf.surface.region_mesh import RegionMesh


def test_cells_are_small_and_what_is_beside_the_region_is_told_from_it():
    whole = plate(0.4, 0.2, 0.05)
    left = whole.vertices[whole.faces].mean(axis=1)[:, 0] < 0.0
    cells = Cells.of(RegionMesh.from_faces(whole, left), 0.02, 0.1)
    assert cells.of_region(cells.areas_m2).sum() == pytest.approx(0.04)
    assert cells.areas_m2.sum() == pytest.approx(0.06, rel=0.05)
    assert (cells.centres[cells.inside, 0] < 0.0).all()
    assert (cells.centres[~cells.inside, 0] > 0.0).all()
    assert cells.areas_m2.max() < 0.02**2
    assert len(cells.fine.faces) == cells.inside.sum()


def test_a_whole_object_has_nothing_beside_it():
    whole = plate(0.1, 0.1, 0.05)
    cells = Cells.of(RegionMesh.from_faces(whole, np.ones(len(whole.faces), bool)), 0.02, 0.1)
    assert cells.inside.all()
    assert cells.normals == pytest.approx(np.tile([0.0, 0.0, 1.0], (len(cells.normals), 1)))
