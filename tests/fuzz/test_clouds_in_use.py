"""From any cloud to its regions and tool paths: a result or a CloudError, and never a crash."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from builders.awkward import OFFSETS, SCALES, clouds
from builders.fuzzing import outcome_of, tries
from builders.taught_box import SAND, bound_knowledge, cloud
from builders.tiny_field import TinyField
from nrdf.io.cloud import PointCloud
from nrdf.process.transfer import ProcessTransfer
from nrdf.regions.model import Model
from nrdf.scans.aligned_scan import align
from nrdf.scans.clean import clean_scan

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")
SENSORS = (None, [0, 0, 0], [3, 0, 0], [1e4, 0, 0], [1e30, 0, 0], [np.nan, 0, 0], [np.inf, 0, 0])


@pytest.fixture(scope="module")
def model():
    torch.manual_seed(0)
    return Model(TinyField(), {"category": "chair"})


@pytest.fixture(scope="module")
def teacher(model):
    return ProcessTransfer(bound_knowledge({"top": [SAND]}, cloud(count=800)), model)


@st.composite
def awkward_clouds(draw):
    """Points (n, 3), normals or None, sensors or None: one of these is often absurd."""
    absurd = draw(st.sampled_from(("", "", "scale", "offset", "normals")))
    scales = SCALES if absurd == "scale" else (1e-6, 1.0, 1e3)
    offsets = OFFSETS if absurd == "offset" else (0.0, 3.0, 1e6)
    points, lines = draw(clouds(260, 400, scales, offsets))
    if absurd == "normals":
        lines = lines * draw(st.sampled_from([1e-300, 1e300, 0.0, np.nan, 3.0]))
    given = draw(st.booleans())
    sensor = draw(st.sampled_from(SENSORS))
    if sensor is not None:
        with np.errstate(over="ignore", invalid="ignore"):
            sensor = points[0] + np.array(sensor) * max(np.ptp(points, axis=0).max(), 1e-300)
    return points, lines if given else None, sensor


@tries(60)
@given(awkward_clouds())
def test_embedding_and_retrieval(model, teacher, cloud):
    points, normals, sensors = cloud

    def retrieve():
        target = PointCloud(points, normals, sensors=sensors)
        found = teacher.reference.retrieve_all({"top": np.arange(50)}, target)
        assert np.isfinite(found["top"].confidence).all()
        assert torch.isfinite(model.encode(target).z).all()

    outcome_of(retrieve)


@tries(40)
@given(awkward_clouds(), st.booleans())
def test_cleaning(cloud, known):
    points, normals, sensors = cloud
    up = np.array([0.0, 1.0, 0.0]) if known else None
    outcome_of(lambda: clean_scan(PointCloud(points, normals, sensors=sensors), up))


@tries(8)
@given(awkward_clouds())
def test_alignment(model, cloud):
    points, normals, sensors = cloud
    examples = [PointCloud(*np.split(np.random.default_rng(0).normal(size=(300, 6)), 2, axis=1))]
    outcome_of(lambda: align(model, PointCloud(points, normals, sensors=sensors), "y",
                             examples=examples))  # fmt: skip


@tries(12)
@given(awkward_clouds())
def test_transfer(teacher, cloud):
    points, normals, sensors = cloud
    outcome_of(lambda: teacher.transfer(PointCloud(points, normals, sensors=sensors, unit="m")))
