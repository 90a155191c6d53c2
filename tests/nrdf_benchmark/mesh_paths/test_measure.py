"""Figures of paths whose figures are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from builders.mesh_targets import PLATE, plate_target, rows_on_top
from nrdf_benchmark.mesh_paths.measure import footprint_fits, measure_mesh_path

ROWS = np.arange(-0.0875, 0.09, 0.025)


def test_even_rows_on_a_plate_meet_every_bar():
    found = measure_mesh_path(plate_target(), "top", rows_on_top(ROWS), PLATE)
    assert found.distance_worst_m < 1e-9 and found.turn_worst_rad_m < 1e-9
    assert found.step_worst == pytest.approx(1.0) and found.steps_above == 0
    assert found.coverage == 1.0 and found.fits
    assert found.spacing_even == 1.0 and found.spacing_worst == pytest.approx(1.0)
    assert (found.strokes, found.short_strokes, found.needless_strokes) == (8, 0, 0)
    assert found.stroke_ratio == pytest.approx(1.0)
    assert found.surface_m == pytest.approx(8 * 0.4)
    between = np.hypot(0.4, 0.025)
    assert found.air_m == pytest.approx(16 * 0.05 + 7 * between)
    assert found.area_m2 == pytest.approx(0.08, rel=0.05)


def test_what_is_wrong_is_seen():
    off = measure_mesh_path(plate_target(), "top", rows_on_top(ROWS, height=2e-3), PLATE)
    assert off.distance_99_m == pytest.approx(2e-3)
    wide = measure_mesh_path(plate_target(), "top", rows_on_top(ROWS[[0, 1, 3, 4]]), PLATE)
    assert wide.spacing_worst == pytest.approx(2.0) and wide.spacing_even < 0.8
    assert wide.coverage < 0.8
    short = measure_mesh_path(plate_target(), "top", rows_on_top(ROWS, length=0.02), PLATE)
    assert short.short_strokes == 8 and short.needless_strokes == 0
    assert short.stroke_ratio == pytest.approx(0.05)


def test_a_step_and_a_turn_inside_a_stroke_are_seen():
    _, work, _ = rows_on_top([0.0])
    kept = np.delete(np.arange(len(work.positions)), slice(20, 24))
    jumps = replace(
        work, positions=work.positions[kept], quaternions_xyzw=work.quaternions_xyzw[kept]
    )
    found = measure_mesh_path(plate_target(), "top", (jumps,), PLATE)
    assert found.step_worst == pytest.approx(5.0) and found.steps_above == 1
    held = Rotation.from_quat(work.quaternions_xyzw)
    tilted = held.as_quat()
    tilted[10:] = (Rotation.from_rotvec([0.0, 0.6, 0.0]) * held[10:]).as_quat()
    found = measure_mesh_path(
        plate_target(), "top", (replace(work, quaternions_xyzw=tilted),), PLATE
    )
    assert found.turn_worst_rad_m == pytest.approx(0.6 / PLATE.spacing_m)


def test_the_footprint_fits_where_a_disc_does():
    assert footprint_fits(plate_target(), "top", 0.05)
    assert not footprint_fits(plate_target(0.4, 0.03), "top", 0.05)
