import numpy as np
import pytest

from builders.regions_of_shapes import disc, plate, tube
from nrdf.errors import ProcessError
from nrdf.toolpath.planners.field_lines import checked, driven, even_levels, lines_at, parts_of
from nrdf.toolpath.strategy import Strategy

STRATEGY = Strategy(stepover_m=0.02, spacing_m=0.01, tool_radius_m=0.012)


@pytest.mark.parametrize("width", [0.015, 0.03, 0.05, 0.1, 0.335])
def test_levels_are_a_stepover_apart_and_reach_the_ends(width):
    values = np.linspace(0.0, width, 5001)
    levels = even_levels(values, np.ones(5001), 0.02)
    assert (np.diff(levels) >= 0.0179).all() and (np.diff(levels) <= 0.0201).all()
    assert 0.0 < levels[0] <= 0.0102 and width - 0.0102 <= levels[-1] < width


def test_a_part_knows_its_sides():
    (flat,), (round_,) = parts_of(plate(), STRATEGY), parts_of(tube(), STRATEGY)
    np.testing.assert_allclose(flat.outward, [0, 0, 1], atol=1e-9)
    assert round_.outward is None
    assert abs(flat.axes[0, 0]) > 0.999
    assert flat.border_distance.max() == pytest.approx(0.1, abs=0.004)


def test_paths_keep_the_margin_and_lie_on_the_region():
    region = disc()
    strategy = Strategy(stepover_m=0.02, spacing_m=0.01, tool_radius_m=0.012, edge_margin_m=0.03)
    (part,) = parts_of(region, strategy)
    lines = lines_at(part, part.mesh.vertices[:, 1], strategy)
    paths = driven(region, part, lines, strategy)
    contacts = np.concatenate([path.contacts for path in paths])
    assert np.linalg.norm(contacts, axis=1).max() == pytest.approx(0.07, abs=0.002)
    assert region.mesh.nearest(contacts).distances.max() < 1e-7
    np.testing.assert_allclose(paths[0].normals, [[0, 0, 1]] * len(paths[0].normals), atol=1e-6)


def test_no_path_is_an_error_that_says_the_margin():
    with pytest.raises(ProcessError, match=r"edge_margin_m is 0\.5"):
        checked([], Strategy(edge_margin_m=0.5))
