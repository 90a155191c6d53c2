from dataclasses import replace

import numpy as np
import trimesh

from builders.regions_of_shapes import flipped, sheet, tube
from nrdf.geometry.polylines import total_length
from nrdf.surface.fine_mesh import refine
from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.target_mesh import TargetMesh
from nrdf.toolpath.planners.field_lines import Part, parts_of
from nrdf.toolpath.planners.rod import plan_rod
from nrdf.toolpath.planners.rod_strokes import rods_of
from nrdf.toolpath.strategy import Strategy

STRATEGY = Strategy(stepover_m=0.02, spacing_m=0.01, tool_radius_m=0.012)


def is_rod(part: Part) -> bool:
    rods, rest = rods_of(part, STRATEGY)
    return bool(rods) and not rest and all(rod.closed for rod in rods)


def test_tubes_are_rods_and_strips_are_not_closed():
    (part,) = parts_of(tube(), STRATEGY)
    assert is_rod(part) and rods_of(part, STRATEGY)[0][0].closed
    (part,) = parts_of(tube(share=0.4), STRATEGY)
    assert not is_rod(part) and not rods_of(part, STRATEGY)[0][0].closed
    paths = plan_rod(tube(share=0.4), STRATEGY)
    assert len(paths) == 4 and min(total_length(path.contacts) for path in paths) > 0.38


def test_four_legs_with_rails_between_are_rods_of_their_own():
    rods, rest = rods_of(Part(refine(*frame(), 0.009)), STRATEGY)
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


def test_a_post_on_a_foot_is_two_rods_and_the_foot_is_whole():
    foot = trimesh.creation.box((0.46, 0.024, 0.024))
    post = trimesh.creation.box((0.05, 0.45, 0.024)).apply_translation((-0.08, 0.225, 0.0))
    both = foot.union(post)
    part = Part(refine(np.array(both.vertices), np.array(both.faces), 0.011))
    rods, rest = rods_of(part, STRATEGY)
    assert len(rods) == 2 and not rest
    for rod, way in zip(sorted(rods, key=lambda rod: rod.around_m), np.eye(3), strict=False):
        straight = np.abs(rod.frame.along @ way)
        assert straight.min() > 0.95
        assert np.ptp(rod.stations) > 0.42


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
    assert len(paths) == 4
    assert min(total_length(path.contacts) for path in paths) > 1.7
