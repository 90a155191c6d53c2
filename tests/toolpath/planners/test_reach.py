import numpy as np

from builders.regions_of_shapes import plate, tube
from nrdf.toolpath.planners.field_lines import lines_at, parts_of
from nrdf.toolpath.planners.raster import plan_raster
from nrdf.toolpath.planners.reach import reached_by, reached_from_lines, reached_from_paths
from nrdf.toolpath.strategy import Strategy

STRATEGY = Strategy(stepover_m=0.02, spacing_m=0.01, tool_radius_m=0.012)


def test_a_line_that_lacks_leaves_its_area():
    region = plate()
    (part,) = parts_of(region, STRATEGY)
    lines = lines_at(part, part.mesh.vertices[:, 1], STRATEGY)
    assert reached_from_lines(region, part, lines, STRATEGY).all()
    missed = ~reached_from_lines(region, part, lines[:4] + lines[5:], STRATEGY)
    np.testing.assert_allclose(part.mesh.centres[missed, 1], 0.09, atol=0.009)
    assert missed.any() and not reached_from_lines(region, part, [], STRATEGY).any()


def test_paths_far_away_reach_nothing():
    (part,) = parts_of(plate(), STRATEGY)
    assert not reached_from_paths(part, plan_raster(tube(radius=0.5), STRATEGY), 0.0012).all()
    assert reached_from_paths(part, plan_raster(plate(), STRATEGY), 0.012).all()


def test_what_faces_away_is_not_reached():
    points = np.array([[0.0, 0, 0], [0.01, 0, 0], [0.01, 0, 0]])
    normals = np.array([[0.0, 0, 1], [0, 0, -1], [0, 0.9, np.sqrt(0.19)]])
    reached = reached_by(points, normals, np.zeros((1, 3)), np.array([[0.0, 0, 1]]), 0.02)
    assert reached.tolist() == [True, False, False]
