import numpy as np
import pytest

from builders.regions_of_shapes import plate, plate_with_hole, tube
from nrdf.surface.fine_mesh import refine


@pytest.mark.parametrize("region", [plate(), plate_with_hole(), tube()])
def test_refined_triangles_are_small_and_lie_in_their_origin(region):
    mesh = region.mesh
    fine = refine(mesh.vertices, mesh.faces, 0.01)
    pairs = fine.edges[0]
    length = np.linalg.norm(np.diff(fine.vertices[pairs], axis=1), axis=2)
    assert np.quantile(length, 0.99) < 0.0145
    np.testing.assert_allclose(fine.areas.sum(), region.area_m2, rtol=1e-9)
    off = fine.centres - mesh.vertices[mesh.faces[fine.origin, 0]]
    assert (
        np.abs(np.einsum("fa,fa->f", off, mesh.face_normals[fine.origin])).max() < 1e-6 * mesh.size
    )
    assert (np.einsum("fa,fa->f", fine.normals, mesh.face_normals[fine.origin]) > 0.999).all()


def test_a_thin_strip_is_cut_across_only():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 0.001, 0], [0, 0.001, 0.0]])
    fine = refine(vertices, np.array([[0, 1, 2], [0, 2, 3]]), 0.01)
    assert len(fine.faces) < 300


def test_gradient_of_a_plane_and_parts():
    fine = refine(plate().mesh.vertices, plate().mesh.faces, 0.02)
    np.testing.assert_allclose(
        fine.slopes(fine.vertices @ [1.0, 2.0, 5.0]), [[1, 2, 0]] * len(fine.faces), atol=1e-9
    )
    np.testing.assert_allclose(fine.mass.sum(), 0.08)
    right = fine.centres[:, 0] > 0.3
    far = fine.centres[:, 0] < 0.05
    areas = [part.areas.sum() for part in fine.part(right | far).components()]
    assert len(areas) == 2 and areas == sorted(areas, reverse=True)
