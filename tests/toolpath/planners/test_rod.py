from dataclasses import replace

import numpy as np
import pytest
import trimesh

from builders.regions_of_shapes import bend, disc, flipped, plate, sheet, tube
from nrdf.geometry.polylines import longest_step, total_length
from nrdf.surface.fine_mesh import refine
from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.target_mesh import TargetMesh
from nrdf.toolpath.planners.field_lines import Part, parts_of
from nrdf.toolpath.planners.raster import plan_raster
from nrdf.toolpath.planners.rod import plan_rod, rods_of
from nrdf.toolpath.strategy import Strategy

STRATEGY = Strategy(stepover_m=0.02, spacing_m=0.01, tool_radius_m=0.012)


def is_rod(part: Part) -> bool:
    rods, rest = rods_of(part)
    return bool(rods) and not rest and all(rod.closed for rod in rods)


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
    assert not is_rod(part) and rods_of(part)[0] == []
    assert len(plan_rod(region, STRATEGY)) == len(plan_raster(region, STRATEGY))


def test_tubes_are_rods_and_strips_are_not_closed():
    (part,) = parts_of(tube(), STRATEGY)
    assert is_rod(part) and rods_of(part)[0][0].closed
    (part,) = parts_of(tube(share=0.4), STRATEGY)
    assert not is_rod(part) and not rods_of(part)[0][0].closed
    paths = plan_rod(tube(share=0.4), STRATEGY)
    assert len(paths) == 4 and min(total_length(path.contacts) for path in paths) > 0.38


def test_a_square_leg_has_strokes_on_its_sides_and_none_on_its_edges():
    paths = plan_rod(
        box((0.4, 0.03, 0.03)), replace(STRATEGY, stepover_m=0.03, tool_radius_m=0.025)
    )
    assert len(paths) == 4
    for path in paths:
        across = np.sort(np.abs(path.contacts[:, 1:]), axis=1)
        assert across[:, 0].max() < 0.004  # in the middle of its side
        np.testing.assert_allclose(across[:, 1], 0.015, atol=1e-6)
        assert total_length(path.contacts) > 0.38


def test_ends_that_are_large_are_worked():
    paths = plan_rod(box((0.4, 0.06, 0.06)), replace(STRATEGY, tool_radius_m=0.02))
    assert sum(total_length(path.contacts) > 0.35 for path in paths) == 12
    ends = [path for path in paths if np.abs(path.normals[:, 0]).min() > 0.9]
    assert {float(np.sign(path.contacts[0, 0])) for path in ends} == {-1.0, 1.0}


def test_four_legs_with_rails_between_are_rods_of_their_own():
    rods, rest = rods_of(Part(refine(*frame(), 0.009)))
    length = sorted(float(np.ptp(rod.stations)) for rod in rods)
    assert len(rods) == 8 and not rest
    np.testing.assert_allclose(length[:4], 0.27, atol=0.05)  # rails, between their legs
    np.testing.assert_allclose(length[4:], 0.4, atol=0.03)
    mesh = TargetMesh(*frame(), ())
    paths = plan_rod(RegionMesh.from_faces(mesh, np.ones(len(mesh.faces), bool)), STRATEGY)
    assert np.median([total_length(path.contacts) for path in paths]) > 0.22
    for path in paths:  # none turns from a leg into a rail
        way = np.ptp(path.contacts, axis=0)
        assert np.sort(way)[1] < 0.03


def test_a_cone_has_straight_strokes():
    for path in plan_rod(cone(), STRATEGY):
        ahead = path.contacts[-1] - path.contacts[0]
        away = np.cross(path.contacts - path.contacts[0], ahead / np.linalg.norm(ahead))
        assert np.linalg.norm(away, axis=1).max() < 0.004


def test_a_margin_keeps_strokes_off_the_border():
    paths = plan_rod(tube(), replace(STRATEGY, edge_margin_m=0.05))
    x = np.concatenate([path.contacts[:, 0] for path in paths])
    assert 0.045 < x.min() < 0.07 and 0.33 < x.max() < 0.355


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


def frame() -> tuple[np.ndarray, np.ndarray]:
    """The surface of four legs of 0.4 m, 0.03 m wide, and a rail between each two."""
    size, low, high = 0.01, 1, 36
    solid = np.zeros((38, 38, 42), bool)
    for x in (low, high - 3):
        for y in (low, high - 3):
            solid[x : x + 3, y : y + 3, 1:41] = True
    for at in (low, high - 3):
        solid[at : at + 3, low : high - 1, 19:22] = True
        solid[low : high - 1, at : at + 3, 19:22] = True
    corners, faces = [], []
    quad = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    for axis in range(3):
        for side in (-1, 1):
            bare = solid & ~np.roll(solid, -side, axis=axis)
            cell = np.argwhere(bare)
            corner = np.repeat(cell[:, None], 4, axis=1)
            corner[:, :, axis] += (side + 1) // 2
            others = [(axis + 1) % 3, (axis + 2) % 3]
            corner[:, :, others] += quad if side == 1 else quad[::-1]
            first = 4 * np.arange(len(cell))[:, None] + sum(4 * len(c) for c in corners)
            faces += [first + np.array(corner_of) for corner_of in ([0, 1, 2], [0, 2, 3])]
            corners.append(corner)
    places, index = np.unique(
        np.concatenate([c.reshape(-1, 3) for c in corners]), axis=0, return_inverse=True
    )
    return size * places.astype(float), index.reshape(-1)[np.concatenate(faces)]


def loop(radius: float = 0.011) -> RegionMesh:
    """A tube that closes to a rounded square of 0.5 m, as the frame of a chair."""

    def place(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        along, around = 2.0 * np.pi * v, 2.0 * np.pi * u
        out = np.stack([np.cos(along), np.sin(along), 0.0 * along], axis=1)
        # |x|^6 + |y|^6 = 1
        far = 0.25 / (np.abs(out[:, :2]) ** 6).sum(axis=1) ** (1 / 6)
        up = np.array([0.0, 0.0, 1.0])
        return far[:, None] * out + radius * (
            np.cos(around)[:, None] * out + np.sin(around)[:, None] * up
        )

    return flipped(sheet(place, 240, 32))


def test_a_tube_that_closes_to_a_ring_has_few_strokes_all_along_it():
    wide = replace(STRATEGY, stepover_m=0.025, tool_radius_m=0.025)
    (part,) = parts_of(loop(), wide)
    assert is_rod(part)
    paths = plan_rod(loop(), wide)
    assert len(paths) == 3
    assert min(total_length(path.contacts) for path in paths) > 1.7


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
