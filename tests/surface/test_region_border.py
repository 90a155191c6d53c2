"""Votes of points as a smooth function on a mesh."""

import numpy as np
import pytest
import trimesh

from nrdf.errors import ProcessError
from nrdf.geometry.mesh import Mesh
from nrdf.surface.region_border import Votes, cut_at_borders
from nrdf.surface.target_mesh import TargetMesh


def sampled(shape: trimesh.Trimesh, count: int = 6000) -> tuple[TargetMesh, np.ndarray, np.ndarray]:
    mesh = TargetMesh.from_mesh(Mesh(np.asarray(shape.vertices), np.asarray(shape.faces)))
    points, face = trimesh.sample.sample_surface(shape, count, seed=0)
    return mesh, np.asarray(points), np.asarray(shape.face_normals[face])


def test_the_border_runs_within_triangles_and_the_sides_of_a_plate_do_not_mix():
    mesh, points, normals = sampled(trimesh.creation.box((1.0, 1.0, 0.004)))
    belongs = (normals[:, 2] > 0.5) & (points[:, 0] > 0.1)
    found = cut_at_borders(mesh, Votes.checked(points, normals, {"top": belongs}), 0.03)
    facing, area, inside = found.mesh.normals[:, 2], found.mesh.areas, found.inside[0]
    assert area[inside & (facing > 0.5)].sum() == pytest.approx(0.4, abs=0.01)
    assert area[inside & (facing < -0.5)].sum() == 0.0
    assert found.mesh.vertices[found.mesh.faces[inside]][..., 0].min() == pytest.approx(
        0.1, abs=0.02
    )


def test_a_border_at_a_crease_runs_along_it():
    mesh, points, normals = sampled(trimesh.creation.box((1.0, 1.0, 0.3)))
    found = cut_at_borders(mesh, Votes.checked(points, normals, {"top": normals[:, 2] > 0.5}), 0.03)
    top = found.mesh.normals[:, 2] > 0.5
    assert found.mesh.areas[found.inside[0] != top].sum() < 1e-4


def test_of_two_regions_the_larger_membership_has_a_place():
    mesh, points, normals = sampled(trimesh.creation.box((1.0, 1.0, 0.1)), 9000)
    x, top = points[:, 0], normals[:, 2] > 0.5
    shares = {"left": np.clip(0.7 - x, 0, 1) * top, "right": np.clip(0.7 + x, 0, 1) * top}
    votes = Votes.checked(points, normals, shares)
    found = cut_at_borders(mesh, votes, 0.03)
    area = found.mesh.areas
    assert not found.inside.all(axis=0).any()
    assert [area[one].sum() for one in found.inside] == pytest.approx([0.5, 0.5], abs=0.02)
    assert found.given_away == pytest.approx([0.2, 0.2], abs=0.02)
    both = cut_at_borders(mesh, votes, 0.03, allow_overlap=True)
    assert both.mesh.areas[both.inside.all(axis=0)].sum() == pytest.approx(0.4, abs=0.03)


@pytest.mark.parametrize(
    ("membership", "message"),
    [
        (np.full(20, 2.0), "0 to 1"),
        (np.full(20, np.nan), "0 to 1"),
        (np.ones(19), "at least 8 points"),
    ],
)
def test_bad_votes_are_refused(membership, message):
    points = np.random.default_rng(0).random((20, 3))
    with pytest.raises(ProcessError, match=message):
        Votes.checked(points, points, {"seat": membership})
