"""Points of a scan on the smooth surface between them, each side of a sheet for itself."""

import numpy as np
import pytest

from builders.surfaces import two_sided
from nrdf.errors import ProcessError
from nrdf.surface.scan_points import for_parts, smooth_points


def ball(count: int = 4000, noise: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    normals = rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return normals * (0.1 + noise * rng.normal(size=(count, 1))), normals


def test_noise_is_smoothed_away():
    points, normals = ball(20_000, noise=0.001)
    scan = smooth_points(points, normals, 0.004)
    off = np.abs(np.linalg.norm(scan.points, axis=1) - 0.1)
    assert len(scan.points) < 16_000 and np.percentile(off, 99) < 1.2e-3
    outward = np.einsum("na,na->n", scan.normals, scan.points) / np.linalg.norm(scan.points, axis=1)
    assert np.percentile(outward, 1) > 0.96


def test_noise_larger_than_the_cells_is_smoothed_over_more_points():
    points, normals = ball(100_000, noise=0.002)
    scan = smooth_points(points, normals, 0.003)
    assert len(scan.points) < 20_000
    off = np.abs(np.linalg.norm(scan.points, axis=1) - 0.1)
    assert np.median(off) < 5e-4


def test_normals_against_all_others_in_their_plane_are_turned():
    points, normals = ball()
    wrong = np.random.default_rng(1).random(len(points)) < 0.05
    scan = smooth_points(points, np.where(wrong[:, None], -normals, normals), 0.002)
    assert (np.einsum("na,na->n", scan.normals, scan.points) > 0.0).mean() > 0.995


def test_thin_sheets_are_thickened_while_they_are_meshed_and_thick_ones_are_not():
    points, normals = two_sided(thickness=0.002)
    scan = smooth_points(points, normals, 0.006)
    assert np.median(scan.offset) == pytest.approx((1.4 * scan.cell - 0.002) / 2.0, rel=0.05)
    points, normals = two_sided(thickness=0.04)
    np.testing.assert_array_equal(smooth_points(points, normals, 0.006).offset, 0.0)


def test_slots_are_widened():
    """Two sheets that face each other: what is between them is outside."""
    points, normals = two_sided(thickness=0.002)
    scan = smooth_points(points, -normals, 0.006)
    assert np.median(scan.offset) == pytest.approx((0.002 - 1.4 * scan.cell) / 2.0, rel=0.05)


def test_very_many_points_are_thinned(monkeypatch):
    monkeypatch.setattr("nrdf.surface.scan_points._MOST_POINTS", 1000)
    scan = smooth_points(*ball(), 1e-6)
    assert 300 < len(scan.points) <= 1000


def test_points_in_a_ball_are_no_surface():
    rng = np.random.default_rng(0)
    points, normals = rng.uniform(-1.0, 1.0, (3000, 3)), ball(3000)[1]
    with pytest.raises(ProcessError, match=r"scattered; remove what is not of the object"):
        smooth_points(points, normals, 0.01)


def test_normals_that_all_look_one_way_are_refused():
    points, _ = ball()
    with pytest.raises(ProcessError, match=r"normals do not belong to the points: \d+ %"):
        smooth_points(points, np.tile([0.0, 0.0, 1.0], (len(points), 1)), 0.01)


def test_every_row_is_worked_once():
    done = np.zeros(20_001, int)

    def work(part: slice) -> None:
        done[part] += 1

    for_parts(work, len(done))
    assert (done == 1).all()
