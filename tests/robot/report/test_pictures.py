"""Pictures of the arm, where this machine can draw."""

from __future__ import annotations

import errno

import numpy as np
import pytest

from nrdf.errors import OutputError
from nrdf.robot.report import pictures
from nrdf.robot.report.pictures import COVERAGE, STILL, _parts, draw_pictures


def test_pictures_show_arm_and_object(plate, tmp_path):
    from matplotlib.image import imread

    missing = draw_pictures(tmp_path, plate, film=False)
    if missing:
        pytest.skip(missing)
    still, coverage = imread(tmp_path / STILL)[..., :3], imread(tmp_path / COVERAGE)[..., :3]
    # The bundled arm's joints are blue; what was worked is green.
    assert ((still[..., 2] > 1.3 * still[..., 0]) & (still[..., 2] > 0.25)).mean() > 0.003
    assert ((coverage[..., 1] > 1.5 * coverage[..., 0]) & (coverage[..., 1] > 0.2)).mean() > 0.01


def test_the_mesh_is_whole_and_its_region_above_it_is_cut_by_colour(plate):
    parts = _parts(plate, "coverage")
    assert len(parts) == 3, "the object, worked, and not worked"
    region = plate.simulation_job.surfaces.regions["top"]
    area = sum(_area(vertices, faces) for vertices, faces, _ in parts[1:])
    assert area == pytest.approx(region.area_m2, rel=0.02)
    for vertices, faces, colour in parts:
        assert faces.max() == len(vertices) - 1 and len(colour) == 3
    assert parts[1][0][:, 1].min() > plate.simulation_job.surfaces.given.vertices[:, 1].max() - 1e-4


def _area(vertices, faces):
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()


def test_a_picture_on_a_full_disk_is_an_output_error(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("nrdf.io.atomic.os.replace", full)
    with pytest.raises(OutputError, match="No space left on device; free some space"):
        pictures._save(tmp_path / "x.png", np.zeros((8, 8, 3), np.uint8))
    assert list(tmp_path.iterdir()) == []
