import numpy as np
import pytest

from builders.regions_of_shapes import plate, tube
from nrdf.geometry.polylines import step_lengths, total_length
from nrdf.surface.fine_mesh import refine
from nrdf.toolpath.planners.level_lines import cut_where, level_lines, resampled


def test_lines_across_a_plate_are_straight_and_whole():
    mesh = refine(plate().mesh.vertices, plate().mesh.faces, 0.01)
    lines = level_lines(mesh, mesh.vertices[:, 1], np.array([0.05, 0.1]))
    assert [line.level for line in lines] == [0, 1]
    for line, y in zip(lines, (0.05, 0.1), strict=True):
        assert not line.closed
        np.testing.assert_allclose(line.points[:, 1:], [[y, 0.0]] * len(line.points), atol=1e-12)
        assert total_length(line.points) == pytest.approx(0.4)
        np.testing.assert_allclose(line.values(mesh.vertices), line.points, atol=1e-12)


def test_rings_of_a_tube_are_closed_and_cut_in_one_piece():
    mesh = refine(tube().mesh.vertices, tube().mesh.faces, 0.01)
    (ring,) = level_lines(mesh, mesh.vertices[:, 0], np.array([0.123]))
    assert ring.closed and total_length(ring.points) == pytest.approx(0.188, rel=0.01)
    above = cut_where(ring, ring.points[:, 2] + 0.01)
    assert len(above) == 1 and not above[0].closed
    assert above[0].points[[0, -1], 2] == pytest.approx([-0.01, -0.01])
    assert cut_where(ring, ring.points[:, 2] - 1.0) == []
    points, faces = resampled(above[0], 0.005)
    assert step_lengths(points).max() <= 0.0055
    corners = mesh.vertices[mesh.faces[faces]]
    off = np.einsum("na,na->n", points - corners[:, 0], mesh.normals[faces])
    assert np.abs(off).max() < 1e-9
