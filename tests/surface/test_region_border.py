"""Votes of points as a smooth function on a mesh."""

import numpy as np
import pytest
import trimesh

from nrdf.errors import ProcessError
from nrdf.geometry.mesh import Mesh
from nrdf.surface.region_border import Votes, cut_at_border
from nrdf.surface.target_mesh import TargetMesh


def sampled(shape: trimesh.Trimesh, count: int = 6000) -> tuple[TargetMesh, np.ndarray, np.ndarray]:
    mesh = TargetMesh.from_mesh(Mesh(np.asarray(shape.vertices), np.asarray(shape.faces)))
    points, face = trimesh.sample.sample_surface(shape, count, seed=0)
    return mesh, np.asarray(points), np.asarray(shape.face_normals[face])


def test_the_border_runs_within_triangles_and_the_sides_of_a_plate_do_not_mix():
    mesh, points, normals = sampled(trimesh.creation.box((1.0, 1.0, 0.004)))
    belongs = (normals[:, 2] > 0.5) & (points[:, 0] > 0.1)
    votes = Votes.checked(points, normals, belongs)
    fine, inside = cut_at_border(mesh, votes, 0.03)
    facing = mesh.face_normals[fine.origin][:, 2]
    area = fine.areas
    assert area[inside & (facing > 0.5)].sum() == pytest.approx(0.4, abs=0.01)
    assert area[inside & (facing < -0.5)].sum() == 0.0
    assert fine.vertices[fine.faces[inside]][..., 0].min() == pytest.approx(0.1, abs=0.02)


def test_what_another_part_covers_is_left_out():
    seat = trimesh.creation.box((0.6, 0.6, 0.1))
    leg = trimesh.creation.box((0.1, 0.1, 0.5))
    leg.apply_translation([0.013, 0.0, -0.25])
    mesh, points, normals = sampled(trimesh.util.concatenate([seat, leg]))
    votes = Votes.checked(points, normals, normals[:, 2] < -0.5)
    fine, inside = cut_at_border(mesh, votes, 0.03)
    under = inside & (np.abs(fine.middles[:, 2] + 0.05) < 1e-6)
    assert fine.areas[under].sum() == pytest.approx(0.36 - 0.01, rel=0.01)


@pytest.mark.parametrize(
    ("membership", "message"),
    [
        (np.full(20, 2.0), "0 to 1"),
        (np.full(20, np.nan), "0 to 1"),
        (np.zeros(20), "no point belongs"),
        (np.ones(19), "at least 8 points"),
    ],
)
def test_bad_votes_are_refused(membership, message):
    points = np.random.default_rng(0).random((20, 3))
    with pytest.raises(ProcessError, match=message):
        Votes.checked(points, points, membership)
