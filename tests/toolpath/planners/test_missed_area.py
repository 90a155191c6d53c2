import numpy as np

from builders.regions_of_shapes import plate, tube
from nrdf.toolpath.planners.field_lines import lines_at, parts_of
from nrdf.toolpath.planners.level_lines import level_lines
from nrdf.toolpath.planners.missed_area import fill_missed_area
from nrdf.toolpath.strategy import Strategy

STRATEGY = Strategy(stepover_m=0.02, spacing_m=0.01, tool_radius_m=0.012)


def test_lines_that_reach_everything_stay_alone():
    region = plate()
    (part,) = parts_of(region, STRATEGY)
    across = part.mesh.vertices[:, 1]
    lines = lines_at(part, across, STRATEGY)
    assert len(fill_missed_area(region, part, across, lines, STRATEGY)) == len(lines)


def test_a_line_that_lacks_is_added():
    region = plate()
    (part,) = parts_of(region, STRATEGY)
    across = part.mesh.vertices[:, 1]
    lines = [line for line in lines_at(part, across, STRATEGY) if line.level != 4]
    found = fill_missed_area(region, part, across, lines, STRATEGY)
    (new,) = found[len(lines) :]
    np.testing.assert_allclose(new.points[:, 1], 0.09, atol=0.004)
    assert np.ptp(new.points[:, 0]) > 0.39


def test_the_side_that_faces_away_is_reached_too():
    region = tube(radius=0.008)
    (part,) = parts_of(region, STRATEGY)
    height = part.mesh.vertices[:, 2]
    top = level_lines(part.mesh, part.mesh.vertices[:, 1], np.zeros(1))[:1]
    found = fill_missed_area(region, part, height, top, STRATEGY)
    sides = {float(np.sign(line.points[:, 1].mean())) for line in found}
    assert len(found) > 1 and sides >= {-1.0, 1.0}
