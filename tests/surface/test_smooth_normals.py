"""Normals as a flat tool feels them."""

import numpy as np
import trimesh

from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.smooth_normals import SmoothNormals
from nrdf.surface.target_mesh import TargetMesh


def test_around_a_region_they_are_those_of_the_whole_object():
    ball = trimesh.creation.icosphere(4, 0.5)
    mesh = TargetMesh(np.asarray(ball.vertices), np.asarray(ball.faces))
    region = RegionMesh.from_faces(mesh, mesh.face_normals[:, 2] > 0.8)
    faces = np.flatnonzero(mesh.face_normals[:, 2] > 0.8)
    places = mesh.vertices[mesh.faces[faces]].mean(axis=1)
    whole = mesh.smooth_normals(places, faces, 0.04)
    np.testing.assert_allclose(region.felt_normals(places, faces, 0.04), whole, atol=0.02)
    # Beyond it nothing is known of what is around: the whole object is asked.
    below = np.array([mesh.face_normals[:, 2].argmin()])
    place = mesh.vertices[mesh.faces[below]].mean(axis=1)
    assert region.felt_normals(place, below, 0.04)[0, 2] < -0.95


def test_thin_triangles_as_long_as_the_object_count_by_their_area():
    # A round plate of needles that meet in its middle, bent down along a line through it.
    count = 2000
    angle = 2.0 * np.pi * np.arange(count) / count
    rim = np.stack([np.cos(angle), np.sin(angle), np.minimum(0.0, -0.3 * np.cos(angle))], axis=1)
    vertices = np.concatenate([[[0.0, 0.0, 0.0]], rim])
    number = np.arange(count)
    faces = np.stack([0 * number, 1 + number, 1 + (number + 1) % count], axis=1)
    felt = SmoothNormals(vertices, faces, 0.02)
    places = np.stack([np.zeros(400), np.linspace(0.2, 0.8, 400), np.zeros(400)], axis=1)
    half = felt(places, np.tile([[0.0, 0.0, 1.0]], (400, 1)))
    lean = np.degrees(np.arctan2(half[:, 0], half[:, 2]))
    assert abs(lean.mean() - np.degrees(np.arctan(0.3)) / 2.0) < 0.5
    assert lean.std() < 1.0
