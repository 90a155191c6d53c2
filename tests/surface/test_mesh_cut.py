"""Meshes refined and cut: the surface stays as it is, neighbours stay sewn together."""

import numpy as np
import pytest
import trimesh

from nrdf.surface.mesh_cut import FineMesh, bisected, cut, refine


@pytest.fixture
def box() -> FineMesh:
    shape = trimesh.creation.box((1.0, 1.0, 0.2))
    return FineMesh(np.asarray(shape.vertices), np.asarray(shape.faces), np.arange(12))


def test_refined_edges_are_short_where_wanted_and_the_mesh_stays_closed(box):
    fine = refine(box, 0.1, lambda middles, radii: middles[:, 0] + radii > 0.2, 10**6)
    shape = trimesh.Trimesh(fine.vertices, fine.faces, process=False)
    assert shape.is_watertight and shape.volume == pytest.approx(0.2)
    assert fine.radii[fine.middles[:, 0] > 0.2].max() <= 0.1 < fine.radii.max()
    assert np.bincount(fine.origin, fine.areas) == pytest.approx(box.areas)


def test_refining_stops_at_the_most_faces(box):
    fine = refine(box, 1e-4, lambda middles, radii: radii > 0.0, 1000)
    assert 1000 < len(fine.faces) < 5000


def test_a_cut_keeps_the_area_and_runs_where_it_is_asked_to(box):
    fine = refine(box, 0.3, lambda middles, radii: radii > 0.0, 10**6)
    x = fine.vertices[:, 0]
    pieces, inside = cut(
        fine, x > 0.123, lambda e: (x[e[:, 0]] - 0.123) / (x[e[:, 0]] - x[e[:, 1]])
    )
    assert pieces.areas.sum() == pytest.approx(2.8) and pieces.areas.min() > 0.0
    assert pieces.areas[inside].sum() == pytest.approx(0.377 * 2.4 + 0.2, rel=1e-3)
    assert trimesh.Trimesh(pieces.vertices, pieces.faces, process=False).is_watertight
    part = pieces.of_faces(inside)
    assert part.vertices[:, 0].min() == pytest.approx(0.123, abs=0.01)
    normals = trimesh.Trimesh(part.vertices, part.faces, process=False).face_normals
    assert normals == pytest.approx(trimesh.creation.box((1, 1, 0.2)).face_normals[part.origin])


def test_a_change_between_two_places_is_found():
    starts, ends = np.zeros((1, 3)), np.ones((1, 3))
    share = bisected(starts, ends, lambda places: places[:, 0] < 0.3, 12)
    assert share[0] == pytest.approx(0.3, abs=1e-3)
