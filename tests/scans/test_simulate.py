"""Simulated depth cameras: what they see is on the object, and they say which triangle it is."""

from __future__ import annotations

import numpy as np
import pytest

from builders.scenes import pose, scan_of, triangles
from nrdf.errors import DataError
from nrdf.scans.simulate import ScanSettings, simulate_scan

CHAIR = 1_000_003


def test_points_lie_on_the_triangles_that_were_hit():
    place = pose(1.0, 300.0, (5, 6, 7))
    scan, mesh = (
        scan_of("chair", CHAIR, place, views=2, noise=0.0, pixels=60),
        triangles("chair", CHAIR),
    )
    a, b, c = (mesh.vertices[mesh.faces[scan.face, i]] for i in range(3))
    second, third = scan.second[:, None], scan.third[:, None]
    true = a + second * (b - a) + third * (c - a)
    np.testing.assert_allclose(place.to_canonical(scan.cloud.points), true, atol=1e-6)
    assert set(scan.view) == {0, 1} and scan.cloud.sensors.shape == (2, 3)
    toward = scan.cloud.sensors[scan.view] - scan.cloud.points
    assert ((toward * scan.normals).sum(1) > 0).all()


def test_noise_moves_points_and_the_floor_belongs_to_no_triangle():
    still, noisy = (
        scan_of("chair", CHAIR, views=1, noise=noise, pixels=60, floor=True) for noise in (0, 0.01)
    )
    assert (still.face == -1).any() and (still.face >= 0).any()
    height = pose(0.7).to_canonical(still.cloud.points[still.face == -1])[:, 1]
    assert np.ptp(height) < 1e-6
    assert len(noisy.cloud) == len(still.cloud)
    moved = np.linalg.norm(noisy.cloud.points - still.cloud.points, axis=1)
    assert 0.003 < moved.mean() < 0.03


def test_settings_that_make_no_sense_are_refused():
    mesh, rng = triangles("chair", CHAIR), np.random.default_rng(0)
    with pytest.raises(DataError, match="views 0 must be 1 or more; noise -1 must be 0 or more"):
        simulate_scan(mesh.vertices, mesh.faces, ScanSettings(views=0, noise=-1), rng)
    with pytest.raises(DataError, match="stand within the object"):
        simulate_scan(mesh.vertices, mesh.faces, ScanSettings(distance=0.3), rng)
