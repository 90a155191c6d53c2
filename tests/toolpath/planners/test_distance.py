import numpy as np
import pytest

from builders.regions_of_shapes import cap, plate, plate_with_hole, tube
from nrdf.surface.fine_mesh import refine
from nrdf.toolpath.planners.distance import (
    distance_across,
    distance_from,
    even_share,
    signed_distance,
)


def fine(region, edge=0.008):
    return refine(region.mesh.vertices, region.mesh.faces, edge)


def test_distance_from_a_plates_border():
    mesh = fine(plate())
    x, y = mesh.vertices[:, 0], mesh.vertices[:, 1]
    true = np.minimum(np.minimum(x, 0.4 - x), np.minimum(y, 0.2 - y))
    assert np.abs(distance_from(mesh, mesh.border) - true).max() < 0.004


def test_signed_distance_on_a_sphere_is_along_the_surface():
    mesh = fine(cap())
    found = signed_distance(mesh, mesh.vertices[:, 0])
    true = 0.2 * np.arcsin(mesh.vertices[:, 0] / 0.2)
    assert np.abs(found - true).max() < 0.005
    even = distance_across(mesh, mesh.vertices[:, 0])
    assert np.ptp(even - true) < 0.001


def test_lines_run_straight_past_a_hole():
    mesh = fine(plate_with_hole())
    found, height = distance_across(mesh, mesh.vertices[:, 1]), mesh.vertices[:, 1]
    assert np.ptp(found - height) < 1e-6
    assert even_share(mesh, found) > 0.9999
    assert even_share(mesh, 1.2 * found) < 1e-4


def test_signed_distance_around_a_tube_grows_to_both_sides():
    mesh = fine(tube())
    found = signed_distance(mesh, mesh.vertices[:, 1])
    true = 0.03 * np.arcsin(np.clip(mesh.vertices[:, 1] / 0.03, -1, 1))
    assert np.quantile(np.abs(found - true), 0.98) < 0.003


def test_a_seed_that_is_nowhere_is_refused():
    mesh = fine(plate(), 0.05)
    with pytest.raises(ValueError, match="nowhere"):
        signed_distance(mesh, mesh.vertices[:, 0] + 1.0)
