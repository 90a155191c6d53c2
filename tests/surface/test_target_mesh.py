"""The mesh that paths are planned on: its skin, nearest places of a side, smooth normals."""

import pickle

import numpy as np
import pytest
import trimesh

from nrdf.errors import ProcessError
from nrdf.geometry.mesh import Mesh
from nrdf.surface.target_mesh import TargetMesh


def target(shape: trimesh.Trimesh) -> TargetMesh:
    return TargetMesh.from_mesh(Mesh(np.asarray(shape.vertices), np.asarray(shape.faces)))


def test_an_inner_part_is_removed_and_faces_look_outwards():
    outer, inner = trimesh.creation.box((1, 1, 1)), trimesh.creation.box((0.2, 0.3, 0.4))
    both = trimesh.util.concatenate([outer, inner])
    both.invert()
    mesh = target(both)
    assert len(mesh.faces) == 12 and mesh.face_areas.sum() == pytest.approx(6.0)
    middles = mesh.vertices[mesh.faces].mean(axis=1)
    assert (np.einsum("fa,fa->f", middles, mesh.face_normals) > 0.4).all()
    assert any(
        "2 parts united, of which others covered 5.2e+03 cm²" in repair for repair in mesh.repairs
    )


def test_a_good_mesh_is_kept_as_it_is():
    sphere = trimesh.creation.icosphere(3, 0.5)
    mesh = target(sphere)
    assert mesh.repairs == () and len(mesh.faces) == len(sphere.faces)
    assert np.allclose(mesh.vertex_normals, mesh.vertices / 0.5, atol=0.01)
    assert mesh.edge_length == pytest.approx(0.075, abs=0.02)


def test_no_surface_is_refused():
    flat = Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]]))
    with pytest.raises(ProcessError, match="no paths can be planned on this mesh"):
        TargetMesh.from_mesh(flat)


def test_nearest_keeps_the_two_sides_of_a_thin_plate_apart():
    mesh = target(trimesh.creation.box((1, 1, 0.002)))
    points = np.array([[0.1, 0.2, 0.003], [0.1, 0.2, 0.003], [0.3, 0.0, 0.0]])
    outward = np.array([[0.0, 0.0, 1.0], [0.0, 0.1, -1.0], [0.1, 0.0, -0.9]])
    near = mesh.nearest(points, outward)
    assert near.points[:, 2] == pytest.approx([0.001, -0.001, -0.001])
    assert near.distances == pytest.approx([0.002, 0.004, 0.001])
    assert near.normals[:, 2] == pytest.approx([1, -1, -1])
    assert np.array_equal(near.normals, mesh.face_normals[near.faces])
    assert mesh.nearest(points).points[:2, 2] == pytest.approx([0.001, 0.001])
    assert len(mesh.nearest(np.zeros((0, 3))).points) == 0


def test_smooth_normals_turn_steadily_over_facets_and_keep_sides_apart():
    tube = target(trimesh.creation.cylinder(0.1, 1.0, sections=24))
    angle = np.linspace(0.0, np.pi, 200)
    around = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    near = tube.nearest(0.1 * around, around)
    smooth = tube.smooth_normals(near.points, near.faces, 0.03)
    turn = np.degrees(np.arccos(np.clip((smooth[1:] * smooth[:-1]).sum(axis=1), -1, 1)))
    assert turn.max() < 3.0  # a facet turns by 15°
    assert np.degrees(np.arccos((smooth * around).sum(axis=1))).max() < 3.0
    plate = target(trimesh.creation.box((1, 1, 0.002)))
    near = plate.nearest(np.zeros((1, 3)), np.array([[0.0, 0.0, -1.0]]))
    assert plate.smooth_normals(near.points, near.faces, 0.05)[0] == pytest.approx([0, 0, -1])


def test_a_submesh_has_the_chosen_faces_only():
    mesh = target(trimesh.creation.box((1, 1, 1)))
    top = mesh.submesh(mesh.face_normals[:, 2] > 0.5)
    assert (len(top.vertices), len(top.faces)) == (4, 2)
    assert (top.vertices[:, 2] == 0.5).all() and (top.face_normals[:, 2] > 0.9).all()


def test_smooth_normals_are_finite_beside_a_face_without_area():
    vertices = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (5, 5, 5), (5, 5, 5), (5, 5, 5)], float)
    mesh = TargetMesh(vertices, np.array([(0, 1, 2), (3, 4, 5)]))
    normals = mesh.smooth_normals(np.array([[0.3, 0.3, 0.0]]), np.array([0]), 0.2)
    assert np.allclose(normals, [[0.0, 0.0, 1.0]])


def test_a_mesh_goes_to_another_process_without_its_trees():
    box = target(trimesh.creation.box())
    asked = np.array([[0.0, 0.0, 2.0]])
    before = box.nearest(asked)
    after = pickle.loads(pickle.dumps(box)).nearest(asked)
    np.testing.assert_array_equal(before.points, after.points)
