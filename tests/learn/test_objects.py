"""Files of any kind become training shapes with +Y up; what cannot be used is named."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from builders.desk_lamps import lamp, write_lamps
from nrdf.errors import CloudError, DataError
from nrdf.learn import objects
from nrdf.learn.objects import cloud_of, find_files, read_object, read_objects, turned


def test_a_mesh_stands_upright_and_knows_its_inside(tmp_path):
    mesh = lamp(0)
    mesh.vertices = mesh.vertices[:, [2, 0, 1]] * 1000  # z up, millimetres
    mesh.export(tmp_path / "lamp.stl")
    shape = read_object(tmp_path / "lamp.stl", "lamp.stl", "lamp", "z")
    extents = np.ptp(shape.surface_points, axis=0)
    wanted = np.sort(lamp(0).extents / lamp(0).extents.max())
    assert extents.argmax() == 1 and np.allclose(np.sort(extents), wanted, atol=0.03)
    assert shape.source == objects.MESH
    inside = shape.query_occupancies
    assert 0.1 < inside.mean() < 0.9
    behind = shape.surface_points - 0.01 * shape.surface_normals
    assert (np.abs(behind) <= np.abs(shape.surface_points).max(0) + 0.01).all()


def test_a_cloud_is_taken_for_a_scan(tmp_path):
    points = trimesh.sample.sample_surface(lamp(1), 3000, seed=0)[0]
    np.savetxt(tmp_path / "scan.xyz", points)
    shape = read_object(tmp_path / "scan.xyz", "scan.xyz", "lamp", "y")
    assert shape.source == objects.SCAN
    assert np.allclose(np.linalg.norm(shape.surface_normals, axis=1), 1.0, atol=1e-4)


def test_turning_keeps_a_shape_canonical(tmp_path):
    lamp(2).export(tmp_path / "lamp.ply")
    shape = read_object(tmp_path / "lamp.ply", "lamp.ply", "lamp", "y")
    image = turned(shape, np.diag([1.0, 1.0, -1.0]))
    assert np.allclose(image.surface_points[:, 2], -shape.surface_points[:, 2], atol=1e-5)
    quarter = turned(shape, np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]]))
    assert np.ptp(quarter.surface_points, axis=0).max() == pytest.approx(1.0, abs=1e-5)
    assert cloud_of(quarter).normals is not None and cloud_of(quarter, False).normals is None


def test_what_is_no_folder_or_too_little_is_said(tmp_path):
    with pytest.raises(DataError, match=r"no folder .*: give the folder with the meshes"):
        find_files(tmp_path / "none")
    with pytest.raises(DataError, match=r"holds no mesh and no scan; known: \.ply"):
        find_files(tmp_path)
    write_lamps(tmp_path, 1)
    with pytest.raises(DataError, match=r"1 object is in .*, and it takes 3 .*registration"):
        find_files(tmp_path)


def test_broken_files_are_named_and_too_many_are_thinned(tmp_path, monkeypatch):
    monkeypatch.setattr(objects, "MOST", 4)
    names = write_lamps(tmp_path / "in", 7)
    (tmp_path / "in" / "lamp0.ply").write_bytes(b"ply\nnonsense")
    files = find_files(tmp_path / "in")
    told = []
    found = read_objects(
        files, tmp_path / "in", "lamp", "y", tmp_path / "out", 1, lambda *n: told.append(n)
    )
    assert list(found.refused) == ["lamp0.ply"] and found.left == 3
    assert len(found.shapes) == 3 and {s.name for s in found.shapes} < set(names)
    assert told[-1] == (4, 4)
    again = read_objects(files, tmp_path / "in", "lamp", "y", tmp_path / "out")
    assert len(again.shapes) == 3  # the broken one alone is tried again


def test_nothing_but_broken_files_is_an_error_with_reasons(tmp_path):
    for n in range(3):
        (tmp_path / f"{n}.obj").write_text("f 1 2 3")
    with pytest.raises(DataError, match=r"0 objects are left of 3 files .*0\.obj: "):
        read_objects(find_files(tmp_path), tmp_path, "lamp", "y", tmp_path / "out" / "read")
    assert not (tmp_path / "out").exists()
    with pytest.raises(CloudError):
        read_object(tmp_path / "0.obj", "0", "lamp", "y")
