"""The model `registration`: in a field's place, without what only a field has."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from builders.small_model import chair
from nrdf.errors import ModelError
from nrdf.field.cloud_encoder import CloudEncoder
from nrdf.field.registration import METADATA, RegistrationField


def test_a_cloud_is_encoded_without_an_embedding():
    model = CloudEncoder(RegistrationField(), METADATA)
    cloud = chair()[0]
    encoded = model.encode(cloud)
    assert encoded.z.shape == (1, 0) and encoded.is_whole
    assert np.ptp(encoded.points, axis=0).max() == pytest.approx(1.0)
    assert (model.category, model.preset, model.kind_network) == ("", "registration", None)


def test_what_only_a_field_has_is_refused():
    field, points = RegistrationField(), torch.zeros(1, 5, 3)
    z = field.embed(points, points)
    for ask in (
        lambda: field.occupancy(z, points),
        lambda: field.describe(z, points, points),
        lambda: field.invert(z, points),
    ):
        with pytest.raises(ModelError, match="the model registration has no"):
            ask()
