"""An untrained field of few weights, and chairs of the parametric family."""

from __future__ import annotations

import numpy as np
import torch

from nrdf.field import build_field
from nrdf.io.cloud import PointCloud
from nrdf.regions.model import Model
from nrdf.shapes.families import get_family

SMALL = {
    "encoder_points": 256,
    "latent": 16,
    "point_features": 16,
    "plane_channels": 4,
    "plane_cells": 8,
    "plane_layers": 1,
    "octaves": 1,
    "decoder_width": 16,
    "decoder_blocks": 1,
    "inverse_width": 16,
    "inverse_blocks": 1,
    "refine_blocks": 1,
}


COUNT = 3000


def build(**sizes) -> Model:
    torch.manual_seed(0)
    return Model(build_field("default", {**SMALL, **sizes}), {"category": "chair"})


def build_doubtful() -> Model:
    """Untrained, it is far off on other chairs; this one knows it."""
    model = build()
    with torch.no_grad():
        model.field.inverse.leave.bias[7] = 1.0  # log error
    return model


def chair(seed: int = 0, count: int = COUNT, draw: int = 0):
    """A cloud of a chair, and its regions as masks."""
    family = get_family("chair")
    sample = family.member(seed).sample_surface(count, np.random.default_rng(draw))
    names = family.region_of(sample.coordinates)
    masks = {name: names == name for name in ("seat", "back-front", "back-back")}
    return PointCloud(sample.points, sample.normals), masks
