"""Cells of a region and of what lies around."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from builders.plate_passes import passes
from nrdf.process_model.cells import Cells, plate
from nrdf.process_model.result_model import ResultModel
from nrdf.process_model.spray_profile import SprayProfile
from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.target_mesh import TargetMesh

GUN = SprayProfile(0.04, 0.03, 4e-7, 0.2)


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


def test_a_region_of_another_mesh_of_the_object_lies_on_the_object_given():
    """A mesh that was planned on lies a little below: there nothing would reach it."""
    whole = plate(0.4, 0.2, 0.05)
    low = TargetMesh(whole.vertices - [0.0, 0.0, 0.002], whole.faces)
    left = whole.vertices[whole.faces].mean(axis=1)[:, 0] < 0.0
    region = replace(RegionMesh.from_faces(low, left), parent=whole)
    cells = Cells.of(region, 0.02, 0.1)
    assert np.abs(cells.centres[:, 2]).max() < 1e-9
    assert cells.areas_m2.sum() == pytest.approx(0.06, rel=0.05)
    exact = RegionMesh.from_faces(whole, left)
    film, wanted = (
        ResultModel.of(one, passes([-0.1], 0.1), GUN, Cells.of(one, 0.02, 0.1)).values()
        for one in (region, exact)
    )
    assert film == pytest.approx(wanted)


def test_rough_cells_are_few_and_every_triangle_has_the_value_of_one():
    whole = plate(0.4, 0.2, 0.005)
    cells = Cells.rough(RegionMesh.from_faces(whole, np.ones(len(whole.faces), bool)), 0.02)
    assert cells.inside.all() and cells.areas_m2.sum() == pytest.approx(0.08)
    assert len(cells.areas_m2) < len(whole.faces) / 20
    across = cells.of_region(cells.centres[:, 0])
    np.testing.assert_allclose(across, cells.fine.centres[:, 0], atol=0.02)
