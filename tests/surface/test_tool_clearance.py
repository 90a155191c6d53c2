"""Crevices and other places of a mesh that a tool cannot access."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from nrdf.errors import ProcessError
from nrdf.geometry.mesh import Mesh
from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.target_mesh import TargetMesh
from nrdf.surface.tool_clearance import accessible_region, has_clearance


def stacked(gap, thickness=0.2):
    """A block of 0.4 m with a smaller one over half of its top, `gap` above it; the top."""
    low = trimesh.creation.box((0.4, 0.2, 0.4))
    high = trimesh.creation.box((0.2, thickness, 0.4))
    high.apply_translation((0.1, 0.1 + 0.5 * thickness + gap, 0.0))
    both = trimesh.util.concatenate([low, high])
    mesh = TargetMesh(np.array(both.vertices), np.array(both.faces))
    top = (mesh.face_normals[:, 1] > 0.9) & (np.arange(len(mesh.faces)) < len(low.faces))
    return RegionMesh.from_faces(mesh, top)


def on_top(region, x):
    points = np.stack([x, np.full_like(x, 0.1), np.zeros_like(x)], axis=1)
    return has_clearance(region.parent, points, np.tile([0.0, 1.0, 0.0], (len(x), 1)), 0.03)


@pytest.mark.parametrize("gap", [0.0, 0.01, 0.025])
def test_what_lies_under_another_part_has_no_clearance(gap):
    x = np.linspace(-0.19, 0.19, 40)
    np.testing.assert_array_equal(on_top(stacked(gap), x), x < 0.0)


def test_a_thin_part_is_not_stepped_over():
    x = np.array([-0.1, 0.1])
    np.testing.assert_array_equal(on_top(stacked(0.02, thickness=0.001), x), [True, False])


def test_walls_beside_and_gaps_that_are_wide_enough_do_not_matter():
    region = stacked(0.05)
    assert on_top(region, np.linspace(-0.19, 0.19, 40)).all()
    assert accessible_region(region, 0.03, 0.02) is region
    assert accessible_region(stacked(0.0), 0.0, 0.02).area_m2 == pytest.approx(0.16)
    sides = RegionMesh.from_faces(region.parent, region.parent.face_normals[:, 0] < -0.9)
    assert accessible_region(sides, 1e9, 0.02) is sides


@pytest.mark.parametrize("gap", [0.0, 0.01])
def test_a_region_is_cut_where_its_clearance_ends(gap):
    left = accessible_region(stacked(gap), 0.03, 0.02)
    assert left.area_m2 == pytest.approx(0.08, rel=0.01)
    assert left.mesh.vertices[:, 0].max() == pytest.approx(0.0, abs=1e-3)


def test_nowhere_any_room():
    under = stacked(0.0)
    corners = under.mesh.vertices.copy()
    corners[:, 0] = np.maximum(corners[:, 0], 0.01)
    small = RegionMesh(TargetMesh(corners, under.mesh.faces), under.parent)
    with pytest.raises(ProcessError, match="nowhere in the region are 30 mm free before"):
        accessible_region(small, 0.03, 0.02)


def test_an_open_scan_has_clearance_where_a_ray_leaves_through_a_hole():
    """A box without its bottom: rays from the inner side of its top meet nothing."""
    box = trimesh.creation.box((0.2, 0.2, 0.2))
    faces = np.array(box.faces)[box.face_normals[:, 2] > -0.9]
    mesh = TargetMesh.from_mesh(Mesh(np.array(box.vertices), faces))
    top = np.array([[0.0, 0.0, 0.1]])
    assert has_clearance(mesh, top, np.array([[0.0, 0.0, 1.0]]), 1.0).all()
