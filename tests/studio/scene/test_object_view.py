"""What is drawn of an object: lines, meshes, painted points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from builders.taught_box import SIZE, cloud
from nrdf.geometry.mesh import Mesh
from nrdf.studio.model.paintable_cloud import PaintableCloud
from nrdf.studio.scene.colours import BARE


@pytest.fixture
def row(scene_view):
    """Three boxes in a row."""
    for number, key in enumerate(("reference", "first", "second")):
        scene_view.add(key, PaintableCloud(cloud(SIZE, 600, number)))
    return scene_view


def test_lines_replace_the_earlier_ones(row):
    view = row.objects["reference"]
    line = np.array([[0.0, 0.9, 0.0], [0.1, 0.9, 0.0], [0.2, 0.9, 0.0]])
    view.draw_lines({"top": ([line], np.array([9, 9, 9])), "bare": ([line[:1]], np.zeros(3))})
    assert [handle.name for handle in view._lines] == [f"{view.path}/line0"]
    view.draw_lines({})
    assert not view._lines


def with_mesh(count: int = 600):
    """The box, with its mesh."""
    points = cloud(SIZE, count, 0)
    low, high = points.points.min(axis=0), points.points.max(axis=0)
    box = trimesh.creation.box(bounds=(low, high))
    return replace(points, mesh=Mesh(np.array(box.vertices), np.array(box.faces)))


def test_an_object_with_a_mesh_is_drawn_as_one_and_painted_points_above_it(scene_view):
    view = scene_view.add("box", PaintableCloud(with_mesh()))
    count = len(view.paintable.points)
    bare = np.tile(BARE, (count, 1)).astype(np.uint8)
    view.set_colours(bare)
    assert not view.points.visible
    painted = bare.copy()
    painted[:40] = (200, 30, 30)
    view.set_colours(painted)
    np.testing.assert_allclose(
        view.points.points, view.paintable.points[:40] * scene_view.units_per_m, atol=1e-6
    )
    assert view.points.colors.shape == (40, 3) and view.points.visible


def test_where_a_scans_surface_has_a_hole_its_points_are_drawn(scene_view):
    view = scene_view.add("box", PaintableCloud(cloud(SIZE, 600, 0)))
    fine = trimesh.Trimesh(*vars(with_mesh().mesh).values()).subdivide_to_size(0.05)
    open_above = fine.triangles_center[:, 1] < fine.vertices[:, 1].max() - 1e-6
    view.draw_surface(Mesh(np.array(fine.vertices), np.array(fine.faces[open_above])))
    view.set_colours(np.tile(BARE, (len(view.paintable.points), 1)).astype(np.uint8))
    shown = view.points.points[:, 1] / scene_view.units_per_m
    assert view.points.visible and shown.min() > fine.vertices[:, 1].max() - 0.05
    view.draw_surface(Mesh(np.array(fine.vertices), np.array(fine.faces)))
    view.set_colours(np.tile(BARE, (len(view.paintable.points), 1)).astype(np.uint8))
    assert not view.points.visible


def test_meshes_of_regions_replace_the_earlier_ones(scene_view):
    view = scene_view.add("box", PaintableCloud(with_mesh()))
    mesh = view.paintable.mesh
    red = np.array([200, 30, 30])
    view.draw_regions({"all": (mesh, red), "again": (mesh, red)})
    assert len(view._regions) == 2
    view.draw_regions({"all": (mesh, red)})
    assert len(view._regions) == 1


def test_a_scan_is_drawn_as_the_mesh_that_was_made_of_it(scene_view):
    view = scene_view.add("box", PaintableCloud(cloud(SIZE, 600, 0)))
    bare = np.tile(BARE, (len(view.paintable.points), 1)).astype(np.uint8)
    view.set_colours(bare)
    assert len(view.points.points) == len(bare), "no mesh yet"
    view.draw_surface(with_mesh().mesh)
    view.set_colours(bare)
    assert not view.points.visible


def test_lines_lie_close_above_a_mesh(scene_view):
    view = scene_view.add("box", PaintableCloud(with_mesh()))
    top = view.paintable.high[1]
    line = np.array([[0.0, top, 0.0], [0.05, top, 0.0]])
    lift = view.lifted(line) - line
    assert 0.0 < np.linalg.norm(lift, axis=1).max() < 0.003 * view.paintable.longest_side
