"""A region of a mesh: its area, borders and parts."""

import numpy as np
import pytest

from nrdf.errors import ProcessError
from nrdf.surface.region_mesh import RegionMesh, region_mesh, region_meshes
from nrdf.surface.target_mesh import TargetMesh


def plate(cells: int = 10, side: float = 1.0) -> TargetMesh:
    """A square sheet of small triangles, facing up (+z)."""
    ticks = np.linspace(0.0, side, cells + 1)
    x, y = np.meshgrid(ticks, ticks, indexing="ij")
    corner = np.arange((cells + 1) ** 2).reshape(cells + 1, -1)
    a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
    faces = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    return TargetMesh(np.stack([x, y, 0 * x], -1).reshape(-1, 3), faces)


def test_a_ring_has_an_outer_border_and_a_hole():
    sheet = plate()
    middle = sheet.vertices[sheet.faces].mean(axis=1)[:, :2]
    ring = RegionMesh.from_faces(sheet, np.abs(middle - 0.5).max(axis=1) > 0.2)
    assert ring.area_m2 == pytest.approx(1.0 - 0.16)
    lengths = [ring.loop_length(loop) for loop in ring.boundary_loops]
    assert lengths == pytest.approx([4.0, 1.6])
    # The region lies to the left: the outer border runs counter-clockwise, the hole clockwise.
    for loop, sign in zip(ring.boundary_loops, (1, -1), strict=True):
        x, y, _ = ring.mesh.vertices[loop].T
        assert np.sign(x @ np.roll(y, -1) - y @ np.roll(x, -1)) == sign
    assert ring.parent is sheet and len(ring.components()) == 1


def test_parts_that_only_a_corner_connects_are_two_with_a_loop_each():
    sheet = plate()
    x, y = sheet.vertices[sheet.faces].mean(axis=1)[:, :2].T
    region = RegionMesh.from_faces(
        sheet,
        ((x < 0.5) & (y < 0.5)) | ((x > 0.5) & (y > 0.6)) | ((x > 0.5) & (x < 0.7) & (y > 0.5)),
    )
    parts = region.components()
    assert [part.area_m2 for part in parts] == pytest.approx([0.25, 0.22])
    assert len(region.boundary_loops) == 2
    assert all(len(part.boundary_loops) == 1 for part in parts)


def test_a_region_needs_faces():
    sheet = plate(2)
    with pytest.raises(ProcessError, match="at least one face"):
        RegionMesh.from_faces(sheet, np.zeros(8, bool))
    with pytest.raises(ProcessError, match="is a mask of 8"):
        RegionMesh.from_faces(sheet, np.array([0, 1]))


def votes_on(sheet: TargetMesh, belongs, count: int = 4000):
    """Random points of a sheet, their normals, and membership (n,) by a function of x and y."""
    points = np.random.default_rng(0).random((count, 3)) * [1.0, 1.0, 0.0]
    return points, np.tile([0.0, 0.0, 1.0], (count, 1)), belongs(*points[:, :2].T).astype(float)


def test_noisy_votes_give_a_disc_with_a_short_border():
    sheet = plate(3)
    points, normals, membership = votes_on(sheet, lambda x, y: np.hypot(x - 0.5, y - 0.5) < 0.3)
    flipped = np.random.default_rng(1).random(len(points)) < 0.08
    region = region_mesh(
        sheet, points, normals, np.where(flipped, 1 - membership, membership), 0.05
    )
    assert region.area_m2 == pytest.approx(np.pi * 0.09, rel=0.04)
    assert len(region.boundary_loops) == 1
    assert region.loop_length(region.boundary_loops[0]) <= 1.1 * 2 * np.pi * 0.3
    assert np.abs(region.mesh.vertices[:, 2]).max() == 0.0


def test_specks_and_holes_of_the_tools_size_go_and_larger_holes_on_request():
    def belongs(x, y):
        ring = np.abs(x - 0.4) + np.abs(y - 0.4)
        big, small = np.hypot(x - 0.3, y - 0.5) < 0.12, np.hypot(x - 0.6, y - 0.3) < 0.04
        speck = np.hypot(x - 0.9, y - 0.9) < 0.04
        return (
            (x > 0.1) & (x < 0.75) & (y > 0.1) & (y < 0.75) & ~big & ~small & (ring < 9)
        ) | speck

    sheet = plate(3)
    votes = votes_on(sheet, belongs, 8000)
    region = region_mesh(sheet, *votes, 0.06)
    assert len(region.boundary_loops) == 2 and len(region.components()) == 1
    said = " ".join(region.changes)
    assert "1 hole filled" in said and "1 speck smaller than the tool removed" in said
    whole = region_mesh(sheet, *votes, 0.06, fill_holes=True)
    assert len(whole.boundary_loops) == 1
    assert whole.area_m2 == pytest.approx(0.65**2, rel=0.03)


def test_a_region_smaller_than_the_tool_is_refused():
    sheet = plate(3)
    votes = votes_on(sheet, lambda x, y: np.hypot(x - 0.5, y - 0.5) < 0.1)
    with pytest.raises(ProcessError, match="smaller than the tool's footprint"):
        region_mesh(sheet, *votes, 0.3)
    with pytest.raises(ProcessError, match="radius must be above 0"):
        region_mesh(sheet, *votes, 0.0)


def test_all_regions_at_once_and_why_one_is_left_out():
    sheet = plate(3)
    points, normals, left = votes_on(sheet, lambda x, y: x < 0.5)
    x, y = points[:, :2].T
    shares = {"left": left, "dot": np.hypot(x - 0.8, y - 0.5) < 0.1, "none": np.zeros(len(points))}
    radii = {"left": 0.05, "dot": 0.3, "none": 0.05}
    meshes = region_meshes(sheet, points, normals, shares, radii)
    assert list(meshes.found) == ["left"]
    assert meshes.found["left"].area_m2 == pytest.approx(0.5, rel=0.03)
    assert "smaller than the tool's footprint" in meshes.left_out["dot"]
    assert meshes.left_out["none"] == "No point belongs to the region by more than a half."


def test_points_that_are_given_many_times_are_one_vote_each():
    sheet = plate(3)
    points, normals, left = (np.repeat(a, 9, axis=0) for a in votes_on(sheet, lambda x, y: x < 0.5))
    assert region_mesh(sheet, points, normals, left, 0.05).area_m2 == pytest.approx(0.5, rel=0.03)


def test_regions_that_overlap_share_nothing_and_say_so():
    sheet = plate(3)
    points, normals, wide = votes_on(sheet, lambda x, y: np.clip(1.2 - x, 0.0, 1.0))
    shares = {"wide": wide, "right": (points[:, 0] > 0.5) * 0.8}
    meshes = region_meshes(sheet, points, normals, shares, {"wide": 0.02, "right": 0.02}).found
    assert meshes["wide"].area_m2 + meshes["right"].area_m2 <= 1.0 + 1e-9
    assert "1 overlap given to another region" in " ".join(meshes["wide"].changes)


def test_a_region_of_another_mesh_of_the_object_is_put_onto_the_one_given():
    parent = plate()
    low = TargetMesh(parent.vertices - [0.0, 0.0, 0.002], parent.faces)
    centres, up = low.vertices[low.faces].mean(axis=1), low.face_normals
    own = RegionMesh(low, low).on_parent(centres, up)
    assert np.array_equal(own[0], centres) and own[2] < 2e-6
    places, normals, same = RegionMesh(low, parent).on_parent(centres, up)
    assert np.abs(places[:, 2]).max() < 1e-9 and np.allclose(normals, up)
    assert 0.002 < same < 0.01


def test_what_was_made_last_is_kept_by_its_key_and_serves_a_first_look():
    target = plate()
    region = RegionMesh.from_faces(target, np.ones(len(target.faces), bool))
    made = region.last("x", 1, object)
    look = region.for_a_look
    assert look.rough and not region.rough and look.mesh is region.mesh
    assert look.last("x", 1, object) is made and region.last("x", 2, object) is not made
