"""A region of a mesh: its area, borders and parts."""

import numpy as np
import pytest
import trimesh

from nrdf.errors import ProcessError
from nrdf.surface.region_mesh import RegionMesh, boundary_loops, edge_components
from nrdf.surface.target_mesh import TargetMesh


def plate(cells: int = 10, side: float = 1.0) -> TargetMesh:
    """A square sheet of small triangles, facing up (+z)."""
    ticks = np.linspace(0.0, side, cells + 1)
    x, y = np.meshgrid(ticks, ticks, indexing="ij")
    corner = np.arange((cells + 1) ** 2).reshape(cells + 1, -1)
    a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
    faces = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    return TargetMesh(np.stack([x, y, 0 * x], -1).reshape(-1, 3), faces)


def test_a_ring_has_an_outer_border_and_a_hole():
    sheet = plate()
    middle = sheet.vertices[sheet.faces].mean(axis=1)[:, :2]
    ring = RegionMesh.from_faces(sheet, np.abs(middle - 0.5).max(axis=1) > 0.2)
    assert ring.area_m2 == pytest.approx(1.0 - 0.16)
    lengths = [ring.loop_length(loop) for loop in ring.boundary_loops]
    assert lengths == pytest.approx([4.0, 1.6])
    # The region lies to the left: the outer border runs counter-clockwise, the hole clockwise.
    for loop, sign in zip(ring.boundary_loops, (1, -1), strict=True):
        x, y, _ = ring.mesh.vertices[loop].T
        assert np.sign(x @ np.roll(y, -1) - y @ np.roll(x, -1)) == sign
    assert ring.parent is sheet and len(ring.components()) == 1


def test_parts_that_only_a_corner_connects_are_two_with_a_loop_each():
    sheet = plate()
    x, y = sheet.vertices[sheet.faces].mean(axis=1)[:, :2].T
    region = RegionMesh.from_faces(
        sheet,
        ((x < 0.5) & (y < 0.5)) | ((x > 0.5) & (y > 0.6)) | ((x > 0.5) & (x < 0.7) & (y > 0.5)),
    )
    parts = region.components()
    assert [part.area_m2 for part in parts] == pytest.approx([0.25, 0.22])
    assert len(region.boundary_loops) == 2
    assert all(len(part.boundary_loops) == 1 for part in parts)


def test_a_closed_mesh_has_no_border():
    sphere = trimesh.creation.icosphere(1)
    assert boundary_loops(np.asarray(sphere.faces)) == []
    assert edge_components(np.asarray(sphere.faces)).max() == 0


def test_a_region_needs_faces():
    sheet = plate(2)
    with pytest.raises(ProcessError, match="at least one face"):
        RegionMesh.from_faces(sheet, np.zeros(8, bool))
    with pytest.raises(ProcessError, match="is a mask of 8"):
        RegionMesh.from_faces(sheet, np.array([0, 1]))
