"""Points mapped onto another shape by a field: what it predicts, and what it leaves open."""

from __future__ import annotations

import numpy as np
import torch

from builders.small_model import build, chair
from nrdf.field.base import Inverse
from nrdf.regions import field_mapper
from nrdf.regions.field_mapper import FieldMapper, describe, invert


def test_a_shape_is_mapped_onto_itself_in_any_chunks(monkeypatch):
    model = build()
    encoded = model.encode(chair()[0])
    k = describe(model, encoded.z, encoded.points, encoded.normals)
    mapped = invert(model, encoded.z, k, encoded.normals)
    np.testing.assert_allclose(mapped.points, encoded.points, atol=1e-5)
    monkeypatch.setattr(field_mapper, "_CHUNK", 700)
    again = describe(model, encoded.z, encoded.points, encoded.normals)
    assert torch.allclose(again, k, atol=1e-5)
    np.testing.assert_allclose(
        invert(model, encoded.z, again, encoded.normals).points, mapped.points, atol=1e-5
    )


def test_what_a_field_does_not_predict_is_certain_and_without_error():
    class Bare:
        field = type("F", (), {"invert": lambda self, z, k: Inverse(k[..., :3])})()

    normals = np.eye(3)
    mapped = invert(Bare(), torch.zeros(1, 1), torch.rand(1, 3, 5), normals)
    np.testing.assert_array_equal(mapped.normals, normals)
    assert (mapped.existence == 1).all() and (mapped.error == 0).all()
    assert (mapped.trust == 1).all() and (mapped.displacement == 0).all()


def test_the_mirror_image_is_mapped_too_and_brought_back():
    """An untrained C puts a shape onto itself; so does its mirror image's."""
    model = build()
    mapper = FieldMapper(model, model.encode(chair()[0]))
    points, normals = mapper.source.points[:50], mapper.source.normals[:50]
    target = model.encode(chair()[0])
    mapped = mapper.map_precisely(points, normals, target)
    np.testing.assert_allclose(mapped.points, points, atol=1e-5)
    np.testing.assert_allclose(mapped.normals, normals, atol=0.01)
    assert mapper._mirror_image(target) is mapper._mirror_image(target)
    np.testing.assert_allclose(mapper._mirror_image(target).points[:, 2], -target.points[:, 2])
