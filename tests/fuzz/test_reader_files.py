"""Clouds and meshes from outside, damaged in every way: read or refused, in time and in memory."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from builders.fuzzing import damaged, outcome_of, tries
from builders.valid_files import CLOUDS, MESHES
from nrdf.errors import CloudError, DataError
from nrdf.io.cloud import PointCloud, read_cloud
from nrdf.io.formats.mesh_file import load_mesh


@pytest.fixture
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("files")


def check(outcome, name):
    if isinstance(outcome, CloudError):
        assert name in str(outcome)
        return
    assert isinstance(outcome, PointCloud) and len(outcome) > 0
    assert np.isfinite(outcome.points).all()
    if outcome.normals is not None:
        np.testing.assert_allclose(np.linalg.norm(outcome.normals, axis=1), 1.0, atol=1e-6)
    if outcome.colours is not None:
        assert outcome.colours.dtype == np.uint8


@pytest.mark.parametrize("name", CLOUDS)
def test_every_valid_file_is_read(folder, name):
    (folder / name).write_bytes(CLOUDS[name])
    assert len(read_cloud(folder / name)) == 4


@tries(1000)
@given(st.data())
def test_damaged_clouds(folder, data):
    name = data.draw(st.sampled_from(sorted(CLOUDS)))
    path = folder / name
    path.write_bytes(data.draw(damaged(CLOUDS[name])))
    check(outcome_of(lambda: read_cloud(path)), name)


@tries(200)
@given(st.data())
def test_damaged_meshes(folder, data):
    name = data.draw(st.sampled_from(sorted(MESHES)))
    path = folder / name
    path.write_bytes(data.draw(damaged(MESHES[name])))
    samples = data.draw(st.sampled_from([0, 50]))
    check(outcome_of(lambda: read_cloud(path, mesh_samples=samples)), name)
    outcome = outcome_of(lambda: load_mesh(path))
    if isinstance(outcome, DataError):
        assert name in str(outcome)
    else:
        vertices, faces = outcome
        assert np.isfinite(vertices).all() and len(faces) > 0
        assert faces.min() >= 0 and faces.max() < len(vertices)
