"""Meshes of objects, and regions on them by the votes of points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from builders.taught_box import SAND, SIZE, bound_knowledge, cloud, solid
from nrdf.errors import ProcessError
from nrdf.geometry.mesh import Mesh
from nrdf.io.cloud import PointCloud
from nrdf.process.object_regions import (
    Votes,
    object_surface,
    reason,
    region_or_reason,
    regions_on,
)

TAUGHT = bound_knowledge({"top": [SAND, {**SAND, "tool": {"radius_mm": 200}}], "right": [SAND]})


def test_a_mesh_stays_and_points_become_one():
    box = object_surface(solid(), TAUGHT.knowledge)
    assert len(box.mesh.faces) == 12 and box.warnings == ()
    made = object_surface(cloud(), TAUGHT.knowledge)
    area = 2.0 * (SIZE[0] * SIZE[1] + SIZE[0] * SIZE[2] + SIZE[1] * SIZE[2])
    assert made.mesh.face_areas.sum() == pytest.approx(area, rel=0.2) and made.warnings == ()


def test_a_mesh_that_is_none_is_said_and_one_of_scattered_points_refused():
    flat = Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]), np.array([[0, 1, 2]]))
    found = object_surface(replace(cloud(), mesh=flat), TAUGHT.knowledge)
    assert len(found.mesh.faces) > 100
    assert found.warnings[0].startswith("the mesh as given is not used, but one made of its points")
    with pytest.raises(ProcessError):
        object_surface(PointCloud(cloud().points[:10], cloud().normals[:10]), TAUGHT.knowledge)


def test_regions_follow_the_votes_for_the_smallest_of_their_tools():
    box = solid()
    surface = object_surface(box, TAUGHT.knowledge)
    found = regions_on(
        surface.mesh, Votes(box.points, box.normals, TAUGHT.regions), TAUGHT.knowledge
    )
    assert set(found.found) == {"top", "right"}
    assert region_or_reason(found, "top").area_m2 == pytest.approx(SIZE[0] * SIZE[2], rel=0.1)
    assert region_or_reason(found, "top").mesh.face_normals[:, 1].min() > -0.1


def test_a_region_without_points_has_a_reason():
    box = solid()
    votes = Votes(box.points, box.normals, {"top": np.zeros(0, int)})
    mesh = object_surface(box, TAUGHT.knowledge).mesh
    found = regions_on(mesh, votes, TAUGHT.knowledge)
    with pytest.raises(ProcessError, match=r"no point belongs to the region by more than a half$"):
        region_or_reason(found, "top")
    with pytest.raises(ProcessError, match="it has no points"):
        region_or_reason(found, "right")
    assert reason("") == ""
