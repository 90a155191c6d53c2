"""Canonical points and normals as an encoded cloud, without a model."""

from __future__ import annotations

import numpy as np
import torch

from nrdf.field.encoded_cloud import EncodedCloud
from nrdf.geometry.similarity import Similarity
from nrdf.io.cloud import PointCloud


def as_encoded(points: np.ndarray, normals: np.ndarray) -> EncodedCloud:
    """Points and normals (n, 3), all of them in use, with an embedding of nothing."""
    pose, cloud = Similarity(np.eye(3), np.zeros(3), 1.0), PointCloud(points, normals)
    return EncodedCloud(cloud, np.arange(len(points)), points, normals, pose, torch.zeros(1, 1))
