from dataclasses import replace

import numpy as np
import pytest
import trimesh

from builders.regions_of_shapes import bend, disc, flipped, plate, sheet, tube
from nrdf.geometry.polylines import longest_step, total_length
from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.target_mesh import TargetMesh
from nrdf.toolpath.planners.field_lines import parts_of
from nrdf.toolpath.planners.raster import plan_raster
from nrdf.toolpath.planners.rod import plan_rod
from nrdf.toolpath.planners.rod_strokes import rods_of
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


@pytest.mark.parametrize("region", [plate(), disc()])
def test_what_is_no_rod_has_a_raster(region):
    (part,) = parts_of(region, STRATEGY)
    assert rods_of(part, STRATEGY)[0] == []
    assert len(plan_rod(region, STRATEGY)) == len(plan_raster(region, STRATEGY))


def test_a_square_leg_has_strokes_on_its_sides_and_ends_and_none_on_its_edges():
    paths = plan_rod(
        box((0.4, 0.03, 0.03)), replace(STRATEGY, stepover_m=0.03, tool_radius_m=0.025)
    )
    ends = [path for path in paths if np.abs(path.normals[:, 0]).min() > 0.9]
    assert len(paths) - len(ends) == 4 and len(ends) == 2
    for path in paths:
        if any(path is end for end in ends):
            continue
        across = np.sort(np.abs(path.contacts[:, 1:]), axis=1)
        assert across[:, 0].max() < 0.004  # in the middle of its side
        np.testing.assert_allclose(across[:, 1], 0.015, atol=1e-6)
        assert total_length(path.contacts) > 0.38


def test_ends_that_are_large_are_worked():
    paths = plan_rod(box((0.4, 0.06, 0.06)), replace(STRATEGY, tool_radius_m=0.02))
    assert sum(total_length(path.contacts) > 0.35 for path in paths) == 12
    ends = [path for path in paths if np.abs(path.normals[:, 0]).min() > 0.9]
    assert {float(np.sign(path.contacts[0, 0])) for path in ends} == {-1.0, 1.0}


def test_a_cone_has_straight_strokes():
    for path in plan_rod(cone(), STRATEGY):
        ahead = path.contacts[-1] - path.contacts[0]
        away = np.cross(path.contacts - path.contacts[0], ahead / np.linalg.norm(ahead))
        assert np.linalg.norm(away, axis=1).max() < 0.004


def test_a_margin_keeps_strokes_off_the_border():
    paths = plan_rod(tube(), replace(STRATEGY, edge_margin_m=0.05))
    x = np.concatenate([path.contacts[:, 0] for path in paths])
    assert 0.045 < x.min() < 0.07 and 0.33 < x.max() < 0.355


def test_ends_that_are_narrower_than_the_tools_radius_are_not_worked():
    fine = replace(STRATEGY, stepover_m=0.03, tool_radius_m=0.025)
    paths = plan_rod(box((0.4, 0.02, 0.02)), fine)
    assert len(paths) == 4 and min(total_length(path.contacts) for path in paths) > 0.38


def test_strokes_look_to_all_sides_of_a_thin_rod():
    wide = replace(STRATEGY, stepover_m=0.025, tool_radius_m=0.025)
    looks = np.array([path.normals[len(path.normals) // 2] for path in plan_rod(tube(0.008), wide)])
    angle = np.linspace(0.0, 2.0 * np.pi, 90)
    around = np.stack([0.0 * angle, np.cos(angle), np.sin(angle)], axis=1)
    assert (around @ looks.T).max(axis=1).min() > 0.6  # within the reach of a tool on one of them


def test_a_wide_panel_that_tapers_has_the_lines_of_a_raster():
    panel = box((1.2, 0.3, 0.02))
    x, y, z = panel.mesh.vertices.T
    mesh = TargetMesh(np.stack([x, y * (1.0 + 0.6 * x), z], axis=1), panel.mesh.faces, ())
    wedge = RegionMesh.from_faces(mesh, np.ones(len(mesh.faces), bool))
    (part,) = parts_of(wedge, STRATEGY)
    assert rods_of(part, STRATEGY)[0] == []
    for path, line in zip(plan_rod(wedge, STRATEGY), plan_raster(wedge, STRATEGY), strict=True):
        np.testing.assert_array_equal(path.contacts, line.contacts)


def box(size: tuple[float, float, float]) -> RegionMesh:
    """A solid block."""
    block = trimesh.creation.box(size)
    mesh = TargetMesh(np.array(block.vertices), np.array(block.faces), ())
    return RegionMesh.from_faces(mesh, np.ones(len(mesh.faces), bool))


def cone() -> RegionMesh:
    """A tapered leg along x."""

    def place(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        far, angle = 0.03 - 0.015 * v, 2.0 * np.pi * u
        return np.stack([0.4 * v, far * np.cos(angle), far * np.sin(angle)], axis=1)

    return flipped(sheet(place, 1, 48))


def test_a_hole_for_a_screw_gets_nothing():
    leg = trimesh.creation.box((0.04, 0.04, 0.5))
    bore = trimesh.creation.cylinder(0.005, 0.1).apply_transform(
        trimesh.transformations.rotation_matrix(np.pi / 2, [0, 1, 0])
    )
    drilled = leg.difference(bore)
    mesh = TargetMesh(np.array(drilled.vertices), np.array(drilled.faces), ())
    whole = RegionMesh.from_faces(mesh, np.ones(len(mesh.faces), bool))
    for path in plan_rod(whole, STRATEGY):
        inside = np.linalg.norm(path.contacts[:, 1:], axis=1) < 0.006
        assert not (inside & (np.abs(path.contacts[:, 0]) < 0.015)).any()
