"""A tool's body beside walls and on bends whose places are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from nrdf.errors import ProcessError
from nrdf.geometry.mesh import Mesh
from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.target_mesh import TargetMesh
from nrdf.toolpath.mesh_planner import plan_on_mesh
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.tool_body import body_touches, region_clear_of_body, touching_places
from nrdf.toolpath.types import Segment

DOWN = np.array([0.0, 0.0, -1.0])


def corner(height=0.3, gap=0.0):
    """A floor at z = 0 and a wall at x = 0.2, from a height on."""
    floor = trimesh.creation.box((0.4, 0.4, 0.02)).apply_translation((0, 0, -0.01))
    wall = trimesh.creation.box((0.02, 0.4, height)).apply_translation(
        (0.21, 0, 0.5 * height + gap)
    )
    both = trimesh.util.concatenate([floor, wall])
    return TargetMesh.from_mesh(Mesh(np.array(both.vertices), np.array(both.faces)))


def places(*x):
    return np.stack([np.array(x), np.zeros(len(x)), np.zeros(len(x))], axis=1)


def test_a_cylinder_touches_a_wall_that_is_nearer_than_its_radius():
    at = places(0.0, 0.16, 0.18, 0.195)
    found = body_touches(corner(), at, np.tile(DOWN, (4, 1)), 0.03, 0.1)
    assert found.tolist() == [False, False, True, True]


def test_a_short_body_passes_under_what_a_long_one_meets():
    at, down = places(0.19), DOWN[None]
    over = corner(0.1, gap=0.08)
    assert not body_touches(over, at, down, 0.03, 0.06)[0]
    assert body_touches(over, at, down, 0.03, 0.12)[0]


def test_what_stands_over_the_axis_is_met_too():
    roof = trimesh.creation.box((0.4, 0.4, 0.004)).apply_translation((0, 0, 0.2))
    mesh = TargetMesh.from_mesh(Mesh(np.array(roof.vertices), np.array(roof.faces)))
    assert body_touches(mesh, places(0.0), DOWN[None], 0.001, 0.25)[0]
    assert not body_touches(mesh, places(0.0), DOWN[None], 0.001, 0.19)[0]


def test_a_disc_may_lie_on_a_ball_and_not_in_a_narrow_bowl():
    ball = trimesh.creation.icosphere(4, 0.1)
    outside = TargetMesh(np.array(ball.vertices), np.array(ball.faces), ())
    top = np.array([[0.0, 0.0, 0.1]])
    assert not body_touches(outside, top, DOWN[None], 0.03, 0.2)[0]
    bowl = TargetMesh(np.array(ball.vertices), np.array(ball.faces)[:, ::-1], ())
    below = np.array([[0.0, 0.0, -0.1]])
    assert body_touches(bowl, below, DOWN[None], 0.09, 0.05)[0]
    assert not body_touches(bowl, below, DOWN[None], 0.01, 0.05)[0]


def test_places_of_a_path_where_the_body_touches():
    held = np.tile([1.0, 0.0, 0.0, 0.0], (41, 1))
    x = np.linspace(0.0, 0.2, 41)
    line = np.stack([x, 0 * x, 0 * x], axis=1)
    work = Segment("process", 0, line, held, 0.1)
    free = Segment("retract", 0, line - 5.0, held, 0.1)
    found, share = touching_places([work, free], corner(), 0.03, 0.1)
    assert found[:, 0].min() == pytest.approx(0.175, abs=0.016)
    assert share == pytest.approx(0.15, abs=0.08)
    assert touching_places([work], corner(), 0.03, 0.0)[1] == 0.0


def test_planned_lines_end_a_bodys_radius_before_a_wall():
    mesh = corner()
    low = np.abs(mesh.vertices[mesh.faces][..., 2]).max(axis=1) < 1e-9
    floor = (mesh.face_normals[:, 2] > 0.9) & low
    region = RegionMesh.from_faces(mesh, floor)
    strategy = Strategy(
        stepover_m=0.02, spacing_m=0.005, tool_radius_m=0.03, clearance_m=0.1,
        direction=np.array([1.0, 0.0, 0.0]),
    )  # fmt: skip
    furthest = {}
    for length in (0.0, 0.1):
        own = replace(strategy, body_radius_m=0.03, body_length_m=length)
        segments = plan_on_mesh(region, own)
        lines = [s.positions for s in segments if s.kind == "process"]
        furthest[length] = np.concatenate(lines)[:, 0].max()
        share = touching_places(segments, mesh, 0.03, 0.1)[1]
        assert (share > 0.02) == (length == 0.0)
    assert furthest[0.0] > 0.185
    assert 0.16 < furthest[0.1] < 0.175  # the wall stands at 0.2


def test_a_body_that_fits_nowhere_is_said():
    mesh = corner(0.4, gap=0.05)  # the wall hangs over a strip of the floor
    low = np.abs(mesh.vertices[mesh.faces][..., 2]).max(axis=1) < 1e-9
    region = RegionMesh.from_faces(mesh, (mesh.face_normals[:, 2] > 0.9) & low)
    strategy = Strategy(
        stepover_m=0.02, spacing_m=0.005, tool_radius_m=0.03, body_radius_m=0.5, body_length_m=0.1
    )
    with pytest.raises(ProcessError, match=r"body, 500 mm in radius.*everywhere in the region"):
        region_clear_of_body(region, strategy)
