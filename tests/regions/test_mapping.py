"""Points mapped onto another shape: what the field predicts, and what it leaves open."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from builders.small_model import build, chair
from nrdf.field.base import Inverse
from nrdf.regions import mapping
from nrdf.regions.mapping import TRUST_SCALE, MappedPoints, describe, invert


def test_a_shape_is_mapped_onto_itself_in_any_chunks(monkeypatch):
    model = build()
    encoded = model.encode(chair()[0])
    k = describe(model, encoded.z, encoded.points, encoded.normals)
    mapped = invert(model, encoded.z, k, encoded.normals)
    np.testing.assert_allclose(mapped.points, encoded.points, atol=1e-5)
    monkeypatch.setattr(mapping, "_CHUNK", 700)
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


def test_trust_falls_with_the_expected_error_and_displacements_add_up():
    zero = np.zeros((2, 3))
    mapped = MappedPoints(zero, zero, np.array([1.0, 0.5]), np.array([TRUST_SCALE, 0.0]), zero)
    np.testing.assert_allclose(mapped.trust, [np.exp(-1), 0.5])
    moved = mapped.displaced(np.ones((2, 3))).displaced(np.ones((2, 3)))
    assert (moved.points == 2).all() and (moved.displacement == 2).all()
    assert moved.select(np.array([1])).existence == pytest.approx([0.5])
