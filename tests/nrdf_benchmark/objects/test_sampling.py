"""Clouds and scans of labelled meshes."""

from __future__ import annotations

import numpy as np
import pytest

from builders.labelled_boxes import write_objects
from nrdf_benchmark.objects.dataset import read_objects
from nrdf_benchmark.objects.sampling import FLOOR, sample_object, scan_object


@pytest.fixture(scope="module")
def objects(tmp_path_factory):
    root = write_objects(tmp_path_factory.mktemp("objects"))
    return {item.key: item for item in read_objects(root)}


def test_points_of_the_skin_carry_the_label_of_their_face(objects):
    mesh = objects["chair/low"]
    seen = sample_object(mesh, 2000)
    again = sample_object(mesh, 2000)
    assert np.array_equal(seen.cloud.points, again.cloud.points)
    corners = mesh.vertices[mesh.faces]
    for name in ("seat", "back", "leg"):
        own = corners[mesh.label == name].reshape(-1, 3)
        points = seen.cloud.points[seen.label == name]
        assert len(points) > 100
        assert (points >= own.min(axis=0) - 1e-9).all() and (points <= own.max(axis=0) + 1e-9).all()


def test_normals_are_estimated_or_the_meshes_own(objects):
    mesh = objects["chair/low"]
    given, estimated = (sample_object(mesh, 1000, kind) for kind in ("given", "estimated"))
    assert np.array_equal(given.cloud.points, estimated.cloud.points)
    own = np.abs(given.cloud.normals)
    assert np.allclose(np.sort(own, axis=1)[:, :2], 0, atol=1e-9)
    agree = (given.cloud.normals * estimated.cloud.normals).sum(axis=1)
    assert (agree > 0.9).mean() > 0.7 and not np.allclose(agree, 1)


def test_scans_know_their_floor_and_the_pose_that_they_were_taken_in(objects):
    mesh = objects["chair/high"]
    seen = scan_object(mesh, 1)
    assert seen.cloud.normals is None and len(seen.cloud.sensors) == 1
    floor = seen.cloud.points[seen.label == FLOOR]
    assert len(floor) > 100 and np.ptp(floor[:, 2]) < 0.02 * seen.pose.scale
    points = seen.pose.to_canonical(seen.cloud.points)
    for name in ("seat", "back"):
        own = mesh.vertices[mesh.faces[mesh.label == name]].reshape(-1, 3)
        inside = (points >= own.min(axis=0) - 0.02) & (points <= own.max(axis=0) + 0.02)
        assert inside.all(axis=1)[seen.label == name].mean() > 0.99
    assert len(scan_object(mesh, 3).cloud.sensors) == 3
