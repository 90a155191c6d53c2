"""?"""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from builders.box_chair import chair, inside_chair
from nrdf.errors import DataError
from nrdf.geometry.mesh import clean_mesh, outer_skin
from nrdf.geometry.winding import mesh_winding_numbers


def flipped_faces(mesh, rng):
    turn = rng.random(len(mesh.faces)) < 0.3
    mesh.faces[turn] = mesh.faces[turn][:, ::-1]


def inverted_part(mesh, rng):
    mesh.faces[: len(mesh.faces) // 6] = mesh.faces[: len(mesh.faces) // 6][:, ::-1]


def missing_faces(mesh, rng):
    mesh.update_faces(rng.random(len(mesh.faces)) > 0.02)


def duplicated_shell(mesh, rng):
    both = np.concatenate([mesh.faces, mesh.faces[:, ::-1]])
    mesh.faces = rng.permutation(both)


def inner_shell(mesh, rng):
    """Something hidden: a small ball within the seat, wound inwards."""
    ball = trimesh.creation.icosphere(2, 0.02)
    ball.invert()
    merged = trimesh.util.concatenate([mesh, ball])
    mesh.vertices, mesh.faces = merged.vertices, merged.faces


DEFECTS = [flipped_faces, inverted_part, missing_faces, duplicated_shell, inner_shell]


@pytest.mark.parametrize("defect", DEFECTS, ids=lambda d: d.__name__)
def test_a_defective_chair_has_its_true_inside_and_normals(defect):
    rng = np.random.default_rng(0)
    mesh = chair()
    defect(mesh, rng)
    vertices, faces = clean_mesh(np.array(mesh.vertices), np.array(mesh.faces))
    faces, skin = outer_skin(vertices, faces, 3000, rng)
    queries = rng.uniform(-0.6, 0.6, (20_000, 3))
    truth, found = inside_chair(queries), mesh_winding_numbers(vertices, faces, queries) > 0.5
    assert (truth & found).sum() / (truth | found).sum() > 0.99
    outwards = ~inside_chair(skin.points + 1e-3 * skin.normals)
    backed = inside_chair(skin.points - 1e-3 * skin.normals)
    assert backed.mean() > 0.998
    assert outwards.mean() > 0.975  # the rest is hidden where the parts meet


def test_the_skin_leaves_hidden_surfaces_out():
    outer = trimesh.creation.icosphere(3, 0.5)
    inner = trimesh.creation.icosphere(3, 0.4)
    both = trimesh.util.concatenate([outer, inner])
    skin = outer_skin(*clean_mesh(both.vertices, both.faces), 2000, np.random.default_rng(0))[1]
    assert len(skin.points) == 2000
    assert (np.linalg.norm(skin.points, axis=1) > 0.45).mean() > 0.99
    assert ((skin.points * skin.normals).sum(axis=1) > 0).mean() > 0.999


def test_an_open_panel_faces_the_side_it_is_seen_from():
    """A car body without underside: outwards is told by visibility, not by a signed volume."""
    shell = trimesh.creation.box((1.0, 0.3, 0.5)).subdivide().subdivide().subdivide()
    shell.update_faces(shell.triangles_center[:, 1] > -0.14)
    shell.invert()
    vertices, faces = clean_mesh(shell.vertices, shell.faces)
    faces, _ = outer_skin(vertices, faces, 2000, np.random.default_rng(0))
    turned = trimesh.Trimesh(vertices, faces, process=False)
    assert ((turned.face_normals * turned.triangles_center).sum(axis=1) > 0).all()


def test_cleaning_merges_and_drops():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [2, 0, 0], [9, 9, 9]], float)
    faces = np.array([[0, 1, 2], [2, 3, 0], [0, 1, 4], [0, 1, 3]])
    merged, kept = clean_mesh(vertices, faces)
    assert len(kept) == 1  # the second is the first turned over, the others have no area
    assert len(merged) == 4


def test_cleaning_a_mesh_without_area_says_so():
    with pytest.raises(DataError, match="no face has an area"):
        clean_mesh(np.zeros((3, 3)), np.array([[0, 1, 2]]))
