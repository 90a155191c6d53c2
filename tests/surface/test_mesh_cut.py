"""Meshes cut: the surface stays as it is, neighbours stay sewn together."""

import numpy as np
import pytest
import trimesh

from nrdf.surface.fine_mesh import FineMesh, refine
from nrdf.surface.mesh_cut import bisected, cut


@pytest.fixture
def box() -> FineMesh:
    shape = trimesh.creation.box((1.0, 1.0, 0.2))
    return refine(np.asarray(shape.vertices), np.asarray(shape.faces), 0.3)


def test_a_cut_keeps_the_area_and_runs_where_it_is_asked_to(box):
    x = box.vertices[box.faces][:, :, 0]
    pieces, values = cut(box, x - 0.123, x[:, :, None])
    assert pieces.areas.sum() == pytest.approx(2.8) and pieces.areas.min() > 0.0
    assert values[:, :, 0] == pytest.approx(pieces.vertices[pieces.faces][:, :, 0])
    inside = pieces.centres[:, 0] > 0.123
    assert pieces.areas[inside].sum() == pytest.approx(0.377 * 2.4 + 0.2, rel=1e-3)
    assert trimesh.Trimesh(pieces.vertices, pieces.faces, process=False).is_watertight
    part = pieces.part(inside)
    assert part.vertices[:, 0].min() == pytest.approx(0.123, abs=0.01)
    normals = trimesh.Trimesh(part.vertices, part.faces, process=False).face_normals
    assert normals == pytest.approx(trimesh.creation.box((1, 1, 0.2)).face_normals[part.origin])


def test_a_function_that_jumps_at_an_edge_is_cut_along_it_and_the_mesh_stays_sewn(box):
    """On top it is positive from x = 0.2 on, elsewhere from 0.1: the cut runs along the rim."""
    x = box.vertices[box.faces][:, :, 0]
    top = box.normals[:, 2] > 0.5
    pieces, values = cut(box, x - np.where(top, 0.2, 0.1)[:, None], np.zeros((len(x), 3, 1)))
    assert values.shape == (len(pieces.faces), 3, 1)
    assert trimesh.Trimesh(pieces.vertices, pieces.faces, process=False).is_watertight
    x = pieces.centres[:, 0]
    top = pieces.normals[:, 2] > 0.5
    inside = x > np.where(top, 0.2, 0.1)
    assert pieces.areas[inside & top].sum() == pytest.approx(0.3, abs=0.02)


def test_what_is_not_crossed_is_left_alone(box):
    level = np.ones((len(box.faces), 3))
    assert cut(box, level, np.zeros((len(box.faces), 3, 0)))[0] is box


def test_a_change_between_two_places_is_found():
    starts, ends = np.zeros((1, 3)), np.ones((1, 3))
    share = bisected(starts, ends, lambda places: places[:, 0] < 0.3, 12)
    assert share[0] == pytest.approx(0.3, abs=1e-3)
