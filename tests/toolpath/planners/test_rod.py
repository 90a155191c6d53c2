import numpy as np
import pytest

from builders.regions_of_shapes import bend, plate, tube
from nrdf.geometry.polylines import longest_step, total_length
from nrdf.toolpath.planners.field_lines import parts_of
from nrdf.toolpath.planners.raster import plan_raster
from nrdf.toolpath.planners.rod import plan_rod, rod_strokes
from nrdf.toolpath.strategy import Strategy

STRATEGY = Strategy(stepover_m=0.02, spacing_m=0.01, tool_radius_m=0.012)


@pytest.mark.parametrize(("region", "length", "most"), [(tube(), 0.4, 10), (bend(), 0.28, 7)])
def test_a_rod_has_few_long_strokes_evenly_around_its_section(region, length, most):
    paths = plan_rod(region, STRATEGY)
    assert len(paths) <= most
    assert min(total_length(path.contacts) for path in paths) > 0.8 * length
    assert max(longest_step(path.contacts) for path in paths) <= 2 * STRATEGY.spacing_m
    contacts = np.concatenate([path.contacts for path in paths])
    assert region.mesh.nearest(contacts).distances.max() < 1e-7
    outward = np.einsum("na,na->n", paths[0].normals, paths[0].normals)
    np.testing.assert_allclose(outward, 1.0)


def test_strokes_of_a_tube_are_even_around_it():
    paths = plan_rod(tube(), STRATEGY)
    angle = np.sort([np.arctan2(*path.contacts[20, :0:-1]) for path in paths])
    np.testing.assert_allclose(np.diff(angle), 2 * np.pi / len(paths), atol=0.1)


@pytest.mark.parametrize("region", [plate(), tube(share=0.4)])
def test_what_is_no_rod_has_a_raster(region):
    (part,) = parts_of(region, STRATEGY)
    assert rod_strokes(region, part, STRATEGY) == []
    assert len(plan_rod(region, STRATEGY)) == len(plan_raster(region, STRATEGY))
