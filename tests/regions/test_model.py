"""A model: what it says of itself, how it is loaded, which clouds it takes."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from builders.small_model import build, chair
from builders.solids import box
from nrdf.errors import CloudError, ConfigError, ModelError
from nrdf.io.cloud import PointCloud
from nrdf.regions.model import Model, load_model


@pytest.fixture(scope="module")
def model() -> Model:
    return build()


def test_a_model_says_what_it_is(model):
    assert (model.category, model.preset) == ("chair", "default")
    assert repr(model) == "Model(category='chair', preset='default', device=cpu)"
    assert not model.field.training


def test_a_model_of_the_zoo_is_loaded_by_name():
    model = load_model("chair")
    assert isinstance(model, Model) and model.category == "chair"
    assert model.metadata["name"] == "chair" and model.device == torch.device("cpu")
    with pytest.raises(ModelError, match="no model 'chiar'"):
        load_model("chiar")
    with pytest.raises(ConfigError, match="no device 'gpu'"):
        load_model("chair", "gpu")


def test_clouds_that_cannot_be_used_are_refused(model):
    points, normals = box((1.0, 0.5, 0.3), 400)
    with pytest.raises(CloudError, match="255 points; at least 256 are needed"):
        model.set_reference(PointCloud(points[:255]))
    flat = points * [1.0, 1.0, 0.0]
    with pytest.raises(CloudError, match="flat"):
        model.set_reference(chair()[0]).retrieve([0], PointCloud(flat, normals))
    points[7, 1] = np.nan
    with pytest.raises(CloudError, match="NaN"):
        model.encode(PointCloud(points))
