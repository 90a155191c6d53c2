from dataclasses import replace

import numpy as np
import pytest

from builders.regions_of_shapes import cap, disc, plate, plate_with_hole, tube
from nrdf.geometry.polylines import step_lengths, total_length
from nrdf.toolpath.planners.field_lines import parts_of
from nrdf.toolpath.planners.steady_spiral import steady_spiral
from nrdf.toolpath.strategy import Strategy

STRATEGY = Strategy(stepover_m=0.02, spacing_m=0.005, tool_radius_m=0.02)


def spiral(region, strategy=STRATEGY):
    (part,) = parts_of(region, strategy)
    return steady_spiral(part, strategy)


def test_a_disc_has_an_even_spiral_from_the_first_turn_to_the_last():
    line = spiral(disc())
    far, angle = np.linalg.norm(line[:, :2], axis=1), np.arctan2(line[:, 1], line[:, 0])
    angle = np.unwrap(angle) * np.sign(np.unwrap(angle)[-1] - angle[0])
    assert far[0] > 0.097 and far[-1] < 0.012
    later = np.interp(angle + 2 * np.pi, angle, far, right=np.nan)
    gap = (far - later)[np.isfinite(later)]
    np.testing.assert_allclose(gap, 0.019, atol=0.003)  # 0.1 m in turns of at most a stepover


@pytest.mark.parametrize("region", [disc(), plate(0.3, 0.2), cap(), plate(0.3, 0.3)])
def test_it_is_one_line_without_jumps_and_as_long_as_its_area(region):
    line = spiral(region)
    assert step_lengths(line).max() < 0.02
    assert 0.85 < total_length(line) * 0.02 / region.area_m2 < 1.2


def test_a_small_tool_goes_along_the_border_first():
    small = replace(STRATEGY, tool_radius_m=0.012)
    line = spiral(disc(), small)
    far = np.linalg.norm(line[:, :2], axis=1)
    first = np.cumsum(step_lengths(line)) < 2 * np.pi * 0.085
    np.testing.assert_allclose(far[1:][first], 0.09, atol=0.002)


@pytest.mark.parametrize("region", [plate_with_hole(), tube(), plate(0.4, 0.03)])
def test_where_rings_part_or_there_is_no_turn_there_is_none(region):
    assert spiral(region) is None
