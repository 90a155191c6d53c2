"""Meshes that are planned on: their size, regions and order."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from builders.labelled_boxes import write_objects
from nrdf.errors import DataError
from nrdf_benchmark.mesh_paths.targets import (
    CAR_M,
    FURNITURE_M,
    PLANE_M,
    WHOLE_M,
    target_sources,
)


def box_car():
    """A body with a cabin behind the bonnet, +X forward, as one closed shape."""
    profile = [(-2, 0), (2, 0), (2, 0.8), (0.7, 0.9), (0.5, 1.4), (-1, 1.4), (-2, 0.9)]
    count = len(profile)
    sides = [np.column_stack([np.array(profile), np.full(count, z)]) for z in (-0.8, 0.8)]
    cap = [(0, 1, 2), (0, 2, 3), (0, 3, 6), (3, 4, 5), (3, 5, 6)]
    faces = [(a, c, b) for a, b, c in cap] + [tuple(k + count for k in face) for face in cap]
    for k in range(count):
        after = (k + 1) % count
        faces += [(k, after, after + count), (k, after + count, k + count)]
    mesh = trimesh.Trimesh(np.concatenate(sides), faces)
    for _ in range(3):
        mesh = mesh.subdivide()
    return mesh


def test_labelled_parts_are_regions_in_metres(tmp_path):
    sources = target_sources([write_objects(tmp_path)])
    assert [source.name for source in sources] == ["chair/low", "chair/high", "stool/plain"]
    chair = sources[0].read()
    assert np.ptp(chair.vertices, axis=0).max() == pytest.approx(FURNITURE_M)
    assert set(chair.visible_regions) == {"seat", "back", "leg"}
    seat = chair.skin.points[chair.indices("seat")]
    assert np.ptp(seat[:, 1]) < 0.2 * FURNITURE_M
    assert [s.name for s in target_sources([tmp_path], 2)] == ["chair/low", "stool/plain"]


def test_a_car_has_bonnet_roof_and_right_door(tmp_path):
    folder = tmp_path / "car"
    folder.mkdir()
    box_car().export(folder / "saloon.ply")
    (source,) = target_sources([folder])
    car = source.read()
    assert source.name == car.name == "car/saloon"
    assert np.ptp(car.vertices, axis=0).max() == pytest.approx(CAR_M)
    middle = {
        name: car.vertices[car.faces[mask]].mean(axis=(0, 1)) for name, mask in car.regions.items()
    }
    assert set(middle) == {"bonnet", "roof", "door"}
    assert middle["bonnet"][0] > 1.0 > middle["roof"][0]
    assert middle["roof"][1] > middle["bonnet"][1] > middle["door"][1]
    assert middle["door"][2] > 0.5


def test_an_aircraft_has_the_upper_side_of_its_right_wing(tmp_path):
    folder = tmp_path / "plane"
    folder.mkdir()
    at = trimesh.transformations.translation_matrix
    parts = [trimesh.creation.box((4.0, 0.4, 0.4)), trimesh.creation.box((0.8, 0.1, 3.6))]
    parts.append(trimesh.creation.box((0.4, 0.06, 1.4), at([-1.7, 0.1, 0.0])))  # the tail
    for _ in range(3):
        parts = [part.subdivide() for part in parts]
    trimesh.util.concatenate(parts).export(folder / "glider.ply")
    plane = target_sources([folder])[0].read()
    assert set(plane.visible_regions) == {"wing"}
    wing = plane.vertices[plane.faces[plane.regions["wing"]]].reshape(-1, 3)
    scale = PLANE_M / 4.0
    assert wing[:, 0].min() > -0.5 * scale and wing[:, 2].max() == pytest.approx(1.8 * scale)
    assert np.allclose(wing[:, 1], 0.05 * scale)


def test_any_other_mesh_is_one_region(tmp_path):
    trimesh.creation.icosphere(3).export(tmp_path / "ball.stl")
    (source,) = target_sources([tmp_path / "ball.stl"])
    ball = source.read()
    assert np.ptp(ball.vertices, axis=0).max() == pytest.approx(WHOLE_M)
    assert len(ball.indices("all")) == len(ball.skin.points)
    assert ball.point_area_m2 * len(ball.skin.points) == pytest.approx(np.pi * WHOLE_M**2, rel=0.02)


def test_places_without_a_mesh_are_refused(tmp_path):
    with pytest.raises(DataError, match="no mesh there"):
        target_sources([tmp_path])
    with pytest.raises(DataError, match="no mesh is given"):
        target_sources([])
    (tmp_path / "broken.ply").write_text("ply")
    with pytest.raises(DataError, match=r"broken\.ply"):
        target_sources([tmp_path / "broken.ply"])[0].read()
