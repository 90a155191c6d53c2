"""Groups of pseudo-correspondences in the files of data folders."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from builders.tiny_field import Ball, balls, write_folder
from nrdf.errors import DataError
from nrdf.shapes import correspond
from nrdf.shapes.correspond import choose_templates, correspond_folders
from nrdf.shapes.dataset import read_shape, read_stamp, shape_paths, write_shape
from nrdf.shapes.registration import RegistrationSettings

SETTINGS = RegistrationSettings(iterations=4)


@pytest.fixture
def folder(tmp_path):
    """4 balls to train on and 2 for validation; one file has a stamp."""
    place = tmp_path / "balls"
    place.mkdir()
    write_folder(place, balls(6))
    write_shape(place / "ball-2.npz", read_shape(place / "ball-2.npz"), "made/1")
    return place


def shapes(folder):
    return [read_shape(path) for path in shape_paths(folder)]


def test_every_shape_gets_every_template(folder):
    told = []
    report = correspond_folders([folder], 2, 1, SETTINGS, lambda *a: told.append(a))
    assert (report.done, report.skipped, len(report.templates)) == (6, 0, 2)
    assert set(report.templates) <= {"ball-0", "ball-1", "ball-2", "ball-3"}  # not of validation
    assert told == [(i, 6) for i in range(1, 7)]
    for shape in shapes(folder):
        assert sorted(shape.correspondences) == ["family-ball", "template-00", "template-01"]
        for name in ("template-00", "template-01"):
            group = shape.correspondences[name]
            assert group.points.shape == group.normals.shape == (300, 3)
            assert group.weight.shape == (300,)
            assert (group.weight >= 0).all() and (group.weight <= 1).all()
            np.testing.assert_allclose(np.linalg.norm(group.normals, axis=1), 1, atol=1e-3)
            distance, nearest = cKDTree(shape.surface_points).query(group.points)
            assert np.median(distance) < 0.05
            assert (group.normals * shape.surface_normals[nearest]).sum(1).mean() > 0.8
    assert not correspond._templates  # megabytes of kernels


def test_groups_correspond_across_shapes(folder):
    """Directions from the centre are the truth for ellipsoids; the group keeps them."""
    correspond_folders([folder], 1, 1, RegistrationSettings(iterations=8))
    directions = []
    for number, shape in enumerate(shapes(folder)):
        radii = np.array(balls(6)[number].radii)
        direction = shape.correspondences["template-00"].points / radii
        directions.append(direction / np.linalg.norm(direction, axis=1, keepdims=True))
    agreement = [(a * b).sum(1).mean() for a in directions for b in directions]
    assert min(agreement) > 0.9


def test_weights_fall_with_the_distance_left(folder, monkeypatch):
    correspond_folders([folder], 1, 1, SETTINGS)
    trusting = shapes(folder)[0].correspondences["template-00"].weight
    monkeypatch.setattr(correspond, "TRUST_SCALE", 0.01)
    correspond_folders([folder], 1, 1, RegistrationSettings(iterations=5))
    strict = shapes(folder)[0].correspondences["template-00"].weight
    assert trusting.mean() > 0.3 and strict.mean() < 0.5 * trusting.mean()


def test_what_is_done_is_kept(folder):
    correspond_folders([folder], 2, 1, SETTINGS)
    before = {path: path.stat().st_mtime_ns for path in shape_paths(folder)}
    report = correspond_folders([folder], 2, 1, SETTINGS)
    assert (report.done, report.skipped) == (0, 6)
    assert before == {path: path.stat().st_mtime_ns for path in shape_paths(folder)}
    assert (read_stamp(folder / "ball-2.npz") or "").startswith("made/1+")

    damaged = folder / "ball-5.npz"  # made anew by whatever made it
    shape = read_shape(damaged)
    write_shape(damaged, shape, "made/2")
    report = correspond_folders([folder], 2, 1, SETTINGS)
    assert (report.done, report.skipped) == (1, 5)
    assert (read_stamp(damaged) or "").startswith("made/2+")


def test_other_settings_or_templates_replace_all_groups(folder):
    correspond_folders([folder], 3, 1, SETTINGS)
    first = shapes(folder)[4].correspondences
    report = correspond_folders([folder], 2, 1, RegistrationSettings(iterations=6))
    assert report.done == 6
    second = shapes(folder)[4].correspondences
    assert sorted(second) == ["family-ball", "template-00", "template-01"]
    assert not np.array_equal(first["template-00"].points, second["template-00"].points)
    assert (read_stamp(folder / "ball-2.npz") or "").count("+") == 1


def test_folders_are_taken_together(folder, tmp_path):
    other = tmp_path / "other"
    other.mkdir()
    write_folder(other, [Ball(f"round-{i}", radii=(0.5, 0.5, 0.5 - 0.02 * i)) for i in range(4)], 1)
    report = correspond_folders([folder, other], 3, 1, SETTINGS)
    assert report.done == 10
    assert any(name.startswith("ball") for name in report.templates)
    assert any(name.startswith("round") for name in report.templates)


def test_templates_may_come_from_one_folder_only(folder, tmp_path):
    other = tmp_path / "others"
    other.mkdir()
    write_folder(other, [Ball(f"other-{i}") for i in range(2)], 0)
    report = correspond_folders([folder, other], 2, 1, SETTINGS, templates_from=other)
    assert set(report.templates) == {"other-0", "other-1"} and report.done == 8


def test_where_there_are_fewer_shapes_than_templates_all_of_them_serve(folder, tmp_path, caplog):
    report = correspond_folders([folder], 12, 1, SETTINGS)
    assert set(report.templates) == {"ball-0", "ball-1", "ball-2", "ball-3"} and report.done == 6
    (said,) = caplog.messages
    assert said.startswith("12 templates were asked for; the 4 training shapes in ")
    assert correspond_folders([folder], 4, 1, SETTINGS).skipped == 6  # the same ones
    other = tmp_path / "others"
    other.mkdir()
    write_folder(other, [Ball(f"other-{i}") for i in range(2)], 0)
    report = correspond_folders([folder], 3, 1, SETTINGS, templates_from=other)
    assert set(report.templates) == {"other-0", "other-1"}


def test_no_templates_at_all_are_refused(folder):
    with pytest.raises(DataError, match="0 templates are none; give 1 or more"):
        correspond_folders([folder], 0, 1, SETTINGS)


def test_without_training_shapes_there_is_nothing_to_do(folder):
    write_folder(folder, balls(2), val=2)
    with pytest.raises(DataError, match=r"no training shapes in .*balls"):
        correspond_folders([folder], 1, 1, SETTINGS)


def test_a_damaged_shape_is_named(folder):
    (folder / "ball-4.npz").write_bytes(b"PK")
    with pytest.raises(DataError, match=r"ball-4\.npz"):
        correspond_folders([folder], 1, 1, SETTINGS)


def test_templates_stand_for_all_kinds():
    kinds = [(0.5, 0.1, 0.1)] * 3 + [(0.1, 0.5, 0.5)] * 2
    found = choose_templates([Ball(f"b{i}", radii=radii) for i, radii in enumerate(kinds)], 3)
    assert len(set(found)) == 3
    assert {found[0] < 3, found[1] < 3} == {True, False}
