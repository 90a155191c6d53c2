"""How a tool is held along paths."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from builders.surface_paths import over_an_edge, rows
from nrdf.errors import ProcessError
from nrdf.geometry.polylines import step_lengths
from nrdf.toolpath.modifiers import drag, edge_contact, offset
from nrdf.toolpath.modifiers.split import turns
from nrdf.toolpath.size_limits import MOST_LINES
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.surface_path import SurfacePath
from nrdf.toolpath.tool_segments import (
    add_approach_retract,
    contact_points,
    steady_tool_segments,
    tool_segments,
)
from nrdf.toolpath.types import Segment

STRATEGY = Strategy(stepover_m=0.025, spacing_m=0.01)


def zigzag(places=(0.0, 0.01, 0.02)) -> SurfacePath:
    lines = [p.reversed() if k % 2 else p for k, p in enumerate(rows(places))]
    return SurfacePath(
        np.concatenate([p.contacts for p in lines]), np.concatenate([p.normals for p in lines])
    )


def rates(segment: Segment) -> np.ndarray:
    return turns(segment.axes) / step_lengths(segment.positions)


def test_the_tool_stands_off_along_its_axis_which_leads_and_tilts():
    strategy = replace(STRATEGY, lead_rad=0.3, tilt_rad=0.1, standoff_m=0.1)
    (path,) = rows([0.0])
    (made,) = tool_segments([path.contacts], [path.normals], strategy)
    tail = -made.axes
    assert np.arctan2(tail[:, 0], tail[:, 2]) == pytest.approx(0.3)
    assert tail[:, 1] == pytest.approx(-np.sin(0.1))
    assert made.positions + 0.1 * made.axes == pytest.approx(path.contacts)


def test_turns_of_a_leading_tool_are_steady_and_its_contacts_stay():
    path = zigzag()
    strategy = replace(STRATEGY, lead_rad=np.radians(30.0), largest_turn_rad_m=20.0)
    (sharp,) = tool_segments([path.contacts], [path.normals], strategy)
    assert rates(sharp).max() > 30.0
    (steady,), (normals,) = steady_tool_segments([path], strategy)
    assert rates(steady).max() <= 20.0
    assert steady.positions == pytest.approx(path.contacts)
    assert normals is path.normals
    # Where the tool goes straight on, it leads as asked.
    assert steady.axes[10] == pytest.approx(sharp.axes[10])


def test_a_path_is_split_where_the_axis_would_be_too_far_off():
    path = over_an_edge(np.radians(150.0))
    lines, normals = steady_tool_segments([path], replace(STRATEGY, largest_turn_rad_m=10.0))
    assert [len(line.positions) for line in lines] == [11, 10] == [len(n) for n in normals]
    assert max(rates(line).max() for line in lines) <= 10.0
    assert [line.line for line in lines] == [0, 1]


def test_a_fixed_heading_does_not_spin_at_turns():
    path = zigzag()
    fixed = replace(STRATEGY, heading="fixed", lead_rad=0.2)
    for strategy in (fixed, replace(fixed, direction=np.array([0.0, 1.0, 0.0]))):
        (line,), _ = steady_tool_segments([path], strategy)
        assert np.ptp(line.quaternions_xyzw, axis=0) == pytest.approx(0.0, abs=1e-9)
    x = Rotation.from_quat(line.quaternions_xyzw).as_matrix()[:, :, 0]
    assert x[:, 1] == pytest.approx(np.cos(0.2))
    (line,), _ = steady_tool_segments([path], STRATEGY)
    assert np.ptp(line.quaternions_xyzw, axis=0).max() > 0.5


def test_contacts_are_found_again_under_all_that_moves_the_tool_off_them():
    strategy = replace(
        STRATEGY, standoff_m=0.02, offset_m=0.003, drag_m=0.004, edge_contact_m=0.02, lead_rad=0.2,
        tilt_rad=-0.1,
    )  # fmt: skip
    (path,) = rows([0.0])
    moved = offset(drag([path], strategy.drag_m), strategy.offset_m)
    lines, _ = steady_tool_segments(moved, strategy)
    (line,) = edge_contact(lines, strategy.edge_contact_m, strategy.lead_rad, strategy.tilt_rad)
    assert np.linalg.norm(line.positions - path.contacts, axis=1).min() > 0.02
    assert contact_points(line, strategy) == pytest.approx(path.contacts)


def test_given_lines_are_driven_as_they_are_and_turned_around_on_the_way_back():
    positions, held = np.zeros((1, 3)), Rotation.from_euler("x", np.pi).as_quat()[None]
    normals = [np.array([[0.0, 0.0, 1.0]])]
    given = [Segment("process", 0, positions, held, 0.1)]
    segments = add_approach_retract(given, normals, replace(STRATEGY, passes=2))
    assert [segment.kind for segment in segments] == ["approach", "process", "retract"] * 2
    np.testing.assert_array_equal(segments[1].quaternions_xyzw, held)
    np.testing.assert_allclose(segments[0].positions[0], [0.0, 0.0, 0.05])
    assert (segments[1].feed_m_s, segments[4].line) == (0.1, 1)
    back = Rotation.from_quat(segments[4].quaternions_xyzw).as_matrix()[0]
    np.testing.assert_allclose(back[:, 0], [-1.0, 0.0, 0.0], atol=1e-9)
    with pytest.raises(ProcessError, match="Give fewer passes"):
        add_approach_retract(given, normals, replace(STRATEGY, passes=MOST_LINES + 1))
