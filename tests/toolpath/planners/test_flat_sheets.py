"""Flat sheets: their direction, and slats that are worked as one."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import trimesh

from builders.regions_of_shapes import cap, plate
from nrdf.geometry.polylines import longest_step
from nrdf.surface.fine_mesh import FineMesh, refine
from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.target_mesh import TargetMesh
from nrdf.toolpath.planners.field_lines import Part, parts_of
from nrdf.toolpath.planners.flat_sheets import is_flat, joined_in_planes, main_direction, with_room
from nrdf.toolpath.planners.raster import plan_raster
from nrdf.toolpath.planners.sheets import sheets_of
from nrdf.toolpath.strategy import Strategy

STRATEGY = Strategy(stepover_m=0.025, spacing_m=0.01, tool_radius_m=0.025)


def slats(gap_m: float, step_m: float = 0.0) -> RegionMesh:
    """Ten slats of 40 x 300 x 20 mm side by side along x; every second one is higher."""
    boxes = []
    for k in range(10):
        slat = trimesh.creation.box((0.04, 0.3, 0.02))
        slat.apply_translation((k * (0.04 + gap_m), 0.0, step_m * (k % 2)))
        boxes.append(slat)
    mesh = trimesh.util.concatenate(boxes)
    target = TargetMesh(np.asarray(mesh.vertices), np.asarray(mesh.faces), ())
    return RegionMesh.from_faces(target, np.ones(len(target.faces), bool))


def all_sheets(region: RegionMesh) -> list[Part]:
    return [s for part in parts_of(region, STRATEGY) for s in sheets_of(region, part, STRATEGY)]


def tops(sheets: list[Part]) -> list[Part]:
    return [s for s in sheets if s.outward is not None and s.outward[2] > 0.9]


def panel(corners: list[tuple[float, float]]) -> Part:
    vertices = np.column_stack([np.array(corners), np.zeros(len(corners))])
    faces = np.array([(0, k, k + 1) for k in range(1, len(corners) - 1)])
    fine: FineMesh = refine(vertices, faces, 0.02)
    return Part(fine)


@pytest.mark.parametrize(
    ("gap", "step", "count"), [(0.002, 0.0, 1), (0.02, 0.0, 10), (0.002, 0.01, 10)]
)
def test_slats_are_one_where_slits_are_narrow_and_even(gap, step, count):
    made = joined_in_planes(all_sheets(slats(gap, step)), STRATEGY.tool_radius_m)
    assert len(tops(made)) == count


def test_lines_run_straight_over_slits():
    region = slats(0.002)
    paths = [path for path in plan_raster(region, STRATEGY) if path.normals[:, 2].mean() > 0.9]
    assert len(paths) == 12
    for path in paths:
        assert np.ptp(path.contacts[:, 0]) > 0.38 and np.ptp(path.contacts[:, 1]) < 1e-6
        assert longest_step(path.contacts) <= 2 * STRATEGY.spacing_m
    # Contacts lie on the slats, none in the air of a slit.
    assert all(np.abs(region.mesh.nearest(p.contacts).distances).max() < 1e-6 for p in paths)
    apart = np.diff(sorted(float(path.contacts[:, 1].mean()) for path in paths))
    assert (apart > 0.85 * 0.025).all() and (apart < 1.15 * 0.025).all()


def test_walls_of_slits_get_no_lines_and_open_ones_do():
    def walls(gap_m: float) -> int:
        region = slats(gap_m)
        kept = with_room(region, all_sheets(region), STRATEGY.tool_radius_m)
        return sum(abs(s.outward[0]) > 0.9 for s in kept if s.outward is not None)

    assert walls(0.002) == 2 and walls(0.02) == 20


def test_the_longest_straight_sides_give_the_direction():
    # A side panel of a chair, cut slantwise by the back: its principal axis runs slantwise.
    part = panel([(0.0, 0.0), (0.7, 0.0), (0.7, 0.5), (0.25, 0.5)])
    assert abs(part.axes[0][1]) > 0.1
    along = main_direction(part)
    assert along is not None and abs(along[0]) == pytest.approx(1.0, abs=1e-3)
    around = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    disc = panel([(0.2 * np.cos(a), 0.2 * np.sin(a)) for a in around])
    assert main_direction(disc) is None


def test_flat_and_curved():
    (flat,), (curved,) = (parts_of(region, STRATEGY) for region in (plate(), cap()))
    assert is_flat(flat) and not is_flat(curved)


def test_one_row_goes_on_where_the_last_ended():
    paths = plan_raster(slats(0.002), STRATEGY)
    top = [path for path in paths if path.normals[:, 2].mean() > 0.9]
    for before, after in pairwise(top):
        assert np.linalg.norm(after.contacts[0] - before.contacts[-1]) < 0.03


@pytest.mark.parametrize(("radius", "worked"), [(0.008, False), (0.06, True)])
def test_the_wall_of_a_hole_gets_lines_where_a_tool_fits_in(radius, worked):
    plank = trimesh.creation.box((0.3, 0.2, 0.04))
    drilled = plank.difference(trimesh.creation.cylinder(radius, 0.1))
    mesh = TargetMesh(np.asarray(drilled.vertices), np.asarray(drilled.faces), ())
    region = RegionMesh.from_faces(mesh, np.ones(len(mesh.faces), bool))
    contacts = np.concatenate([path.contacts for path in plan_raster(region, STRATEGY)])
    inside = np.linalg.norm(contacts[:, :2], axis=1) < radius + 0.001
    assert (inside & (np.abs(contacts[:, 2]) < 0.015)).any() == worked
