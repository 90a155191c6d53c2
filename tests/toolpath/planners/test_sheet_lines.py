from dataclasses import replace

import numpy as np
import pytest

from builders.regions_of_shapes import arch, plate, ring, tube
from nrdf.geometry.polylines import total_length
from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.target_mesh import TargetMesh
from nrdf.toolpath.planners.field_lines import parts_of
from nrdf.toolpath.planners.sheet_lines import sheet_lines, usual_length
from nrdf.toolpath.strategy import Strategy

STRATEGY = Strategy(stepover_m=0.02, spacing_m=0.01, tool_radius_m=0.012)


def lines_of(region, strategy=STRATEGY):
    (part,) = parts_of(region, strategy)
    return sheet_lines(region, part, strategy)


def test_lines_follow_a_bent_strip():
    lines = lines_of(arch(width=0.06))
    far = [np.linalg.norm(line.points, axis=1) for line in lines]
    assert len(lines) == 3 and max(np.ptp(one[15:-15]) for one in far) < 0.005
    np.testing.assert_allclose(sorted(one.mean() for one in far), [0.28, 0.3, 0.32], atol=0.003)


def test_a_narrow_strip_has_one_line_along_it_whatever_the_direction():
    across = replace(STRATEGY, direction=np.array([0.0, 1.0, 0.0]))
    for strategy in (STRATEGY, across):
        (line,) = lines_of(plate(0.4, 0.016), strategy)
        np.testing.assert_allclose(line.points[:, 1], 0.008, atol=0.002)
        assert np.ptp(line.points[:, 0]) > 0.39


def test_a_band_has_a_line_around_it():
    (line,) = lines_of(ring(height=0.015))
    assert line.closed
    np.testing.assert_allclose(line.points[:, 2], 0.0075, atol=0.001)


def test_a_narrow_sheet_that_turns_over_is_reached_on_all_sides():
    assert len(lines_of(tube(radius=0.006, share=0.5))) in (2, 3)
    assert len(lines_of(plate(0.4, 0.0188))) == 1


def test_short_pieces_count_little_in_the_usual_length():
    lines = lines_of(plate())
    assert usual_length(lines) == pytest.approx(total_length(lines[0].points), rel=1e-6)
    assert usual_length([]) == 0.0


def test_lines_of_a_long_sheet_stay_straight_past_what_stands_in_their_way():
    x, y = np.meshgrid(np.arange(91), np.arange(13), indexing="ij")
    corners = np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3) * 0.02
    number = np.arange(len(corners)).reshape(91, 13)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    there = np.ones((90, 12), bool)
    there[42:44, :6] = there[48:, 8:] = False  # a pod, and a flap
    faces = np.stack([a, b, c, a, c, d], axis=-1)[there].reshape(-1, 3)
    mesh = TargetMesh(corners, faces)
    wing = RegionMesh.from_faces(mesh, np.ones(len(faces), bool))
    strategy = Strategy(stepover_m=0.03, spacing_m=0.01, tool_radius_m=0.03)
    (part,) = parts_of(wing, strategy)
    lines = sheet_lines(wing, part, strategy)
    assert max(np.ptp(line.points[:, 1]) for line in lines) < 1e-3
