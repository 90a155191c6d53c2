import numpy as np

from builders.regions_of_shapes import plate, tube
from nrdf.surface.fine_mesh import FineMesh, refine
from nrdf.toolpath.planners.reeb_graph import crossings, reeb_graph, touching_faces


def fine(region) -> FineMesh:
    return refine(region.mesh.vertices, region.mesh.faces, 0.009)


def test_a_tube_is_a_chain_of_rings():
    graph = reeb_graph(fine(tube()), np.zeros((0, 2), int))
    assert np.bincount(graph.links.ravel()).max() == 2
    middle = np.abs(graph.centre[:, 0] - 0.2) < 0.1
    np.testing.assert_allclose(graph.centre[middle, 1:], 0.0, atol=0.006)
    np.testing.assert_allclose(graph.around[middle], 2 * np.pi * 0.03, rtol=0.2)
    assert middle.sum() * graph.band_m > 0.18


def test_what_has_a_common_edge_does_not_touch():
    assert not len(touching_faces(fine(plate())))


def test_crossings_are_where_a_value_is():
    mesh = fine(plate())
    face = np.arange(len(mesh.faces))
    one, other, crossed = crossings(mesh, mesh.vertices[:, 0], face, np.full(len(face), 0.1234))
    np.testing.assert_allclose(one[crossed, 0], 0.1234)
    np.testing.assert_allclose(other[crossed, 0], 0.1234)
    assert np.isclose(np.linalg.norm(other - one, axis=1)[crossed].sum(), 0.2)
