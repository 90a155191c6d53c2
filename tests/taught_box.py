"""A box that processes are taught on: what the tests of transfer share."""

from __future__ import annotations

import numpy as np

from nrdf.cloud import PointCloud
from nrdf.process.knowledge import Knowledge
from nrdf.process.lesson import Lesson
from solids import box

SIZE = np.array([0.5, 0.6, 0.9])
POINTS = 3000
SAND = {
    "kind": "sand", "stepover_mm": 40, "spacing_mm": 20, "tool": {"radius_mm": 25},
    "force_n": 10, "feed_mm_s": 100,
}  # fmt: skip


def cloud(size=SIZE, count=POINTS, seed=0):
    points, normals = box(size, count, seed)
    return PointCloud(points, normals, unit="m")


def faces(of):
    """Indices of a box's points by face."""
    normals = of.normals
    return {
        "top": np.flatnonzero(normals[:, 1] > 0.5),
        "front": np.flatnonzero(normals[:, 0] > 0.5),
        "right": np.flatnonzero(normals[:, 2] > 0.5),
    }


def lesson(processes, reference=None, **changes):
    """Knowledge of processes by face, on a box."""
    reference = cloud() if reference is None else reference
    regions = {name: faces(reference)[name] for name in processes}
    rows = [
        {"name": name, "indices": regions[name].tolist(), "processes": given}
        for name, given in processes.items()
    ]
    content = {"category": "chair", "reference": {"cloud": "box.ply"}, "regions": rows, **changes}
    return Lesson(Knowledge.model_validate(content), reference, regions)
