"""Samples of regions whose shares are known."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from nrdf.errors import ProcessError
from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.target_mesh import TargetMesh
from nrdf.toolpath.region_samples import RegionSamples, border_distance, sample_evenly
from nrdf.toolpath.strategy import Strategy

STRATEGY = Strategy(tool_radius_m=0.02, stepover_m=0.03)


def block(*also):
    """The top of a block of 0.4 by 0.2 m, at height 0."""
    low = trimesh.creation.box((0.4, 0.2, 0.1)).apply_translation((0.0, 0.0, -0.05))
    whole = trimesh.util.concatenate([low, *also])
    mesh = TargetMesh(np.array(whole.vertices), np.array(whole.faces))
    top = (mesh.face_normals[:, 2] > 0.9) & (np.arange(len(mesh.faces)) < 12)
    return RegionMesh.from_faces(mesh, top)


def test_samples_are_even_deterministic_and_about_a_quarter_radius_apart():
    samples = RegionSamples.of(block(), STRATEGY)
    assert len(samples.points) == pytest.approx(0.08 / 0.005**2, rel=0.01)
    away = cKDTree(samples.points).query(samples.points, [2])[0]
    assert np.median(away) > 0.5 * 0.005
    assert away.max() < 2.0 * 0.005
    np.testing.assert_array_equal(samples.points, RegionSamples.of(block(), STRATEGY).points)
    np.testing.assert_allclose(samples.normals, np.tile([0, 0, 1.0], (len(samples.points), 1)))
    assert samples.accessible.all() and samples.inside_margin.all()


def test_samples_of_a_region_are_worked_out_once_and_not_sent_to_other_processes():
    region = block()
    samples = RegionSamples.of(region, STRATEGY)
    assert RegionSamples.of(region, replace(STRATEGY, stepover_m=0.02)) is samples
    finer = RegionSamples.of(region, replace(STRATEGY, tool_radius_m=0.01))
    assert len(finer.points) > len(samples.points)
    margin = RegionSamples.of(region, replace(STRATEGY, edge_margin_m=0.03))
    assert not margin.inside_margin.all() and samples.inside_margin.all()
    assert not pickle.loads(pickle.dumps(region)).memo


@pytest.mark.parametrize("off_m", [-0.002, 0.002])
def test_a_region_of_a_scan_is_asked_about_on_the_mesh_that_was_given(off_m):
    exact = block()
    shifted = TargetMesh(exact.mesh.vertices + np.array([0.0, 0.0, off_m]), exact.mesh.faces)
    assert RegionSamples.of(replace(exact, mesh=shifted), STRATEGY).accessible.all()


def test_every_sample_stands_for_the_same_area_whatever_the_triangles():
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.01, 0.01, 0]], float)
    faces = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    points, face = sample_evenly(TargetMesh(corners, faces), 0.01)
    assert len(points) == 10_000
    assert (points[:, 0] < 0.5).mean() == pytest.approx(0.5, abs=0.005)
    assert (points[:, 0] + points[:, 1] < 1.0).mean() == pytest.approx(0.5, abs=0.005)
    assert np.bincount(face).min() > 0


def test_samples_are_at_most_20_000_and_some_on_the_smallest_region():
    assert len(sample_evenly(block().mesh, 1e-4)[0]) == 20_000
    assert len(sample_evenly(block().mesh, 1.0)[0]) == 400
    flat = TargetMesh(np.zeros((3, 3)), np.array([[0, 1, 2]]))
    with pytest.raises(ProcessError, match="without area"):
        sample_evenly(flat, 0.01)


def test_the_margin_is_measured_along_the_surface():
    samples = RegionSamples.of(block(), replace(STRATEGY, edge_margin_m=0.03))
    x, y, _ = np.abs(samples.points).T
    far = np.minimum(0.2 - x, 0.1 - y)
    assert (samples.inside_margin == (far >= 0.03))[np.abs(far - 0.03) > 0.004].all()
    assert samples.inside_margin.mean() == pytest.approx(0.34 * 0.14 / 0.08, abs=0.02)


def test_a_closed_part_has_no_margin():
    ball = trimesh.creation.icosphere(3, 0.1)
    mesh = TargetMesh(np.array(ball.vertices), np.array(ball.faces))
    points, faces = sample_evenly(mesh, 0.01)
    assert np.isinf(border_distance(mesh, points, mesh.face_normals[faces], 0.02)).all()


def test_the_margin_is_kept_from_what_the_tool_cannot_access():
    over = trimesh.creation.box((0.2, 0.2, 0.1)).apply_translation((0.1, 0.0, 0.06))
    strategy = replace(STRATEGY, clearance_m=0.03, edge_margin_m=0.02)
    samples = RegionSamples.of(block(over), strategy)
    assert samples.accessible.mean() == pytest.approx(0.5, abs=0.01)
    assert samples.points[samples.wanted, 0].max() == pytest.approx(-0.02, abs=0.004)
    shares = samples.coverage(samples.points[:, 0] < -0.05)
    assert shares.worked == pytest.approx(0.375, abs=0.01)
    assert shares.left_out["no_clearance"] == pytest.approx(0.5, abs=0.01)
    assert shares.unreached == pytest.approx(0.03 * 0.16 / 0.08, abs=0.01)
    assert shares.left_out["edge_margin"] > 0.02
    assert shares.worked + sum(shares.left_out.values()) + shares.unreached == pytest.approx(1.0)
