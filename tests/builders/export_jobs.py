"""Jobs that the tests of the exports write."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from nrdf.geometry.similarity import Similarity
from nrdf.toolpath.types import Job, Segment, ToolPath


def wild_job(seed: int = 0) -> Job:
    """Two paths of two tools with random orientations, gimbal lock and half turns among them, and a
    segment with a feed for each waypoint."""
    rng = np.random.default_rng(seed)

    def segment(kind, line, count, force=None, dwell=0.0):
        quaternions = Rotation.random(count, random_state=rng).as_quat()
        special = [[0, 90, 0], [30, -90, 0], [0, 0, 180], [180, 0, 0], [0, 180, 0], [0, 0, 0]]
        turned = Rotation.from_euler("ZYX", special, degrees=True).as_quat()
        quaternions[: min(6, count)] = turned[:count]
        positions = rng.uniform(-1.5, 1.5, (count, 3))
        feed = float(rng.uniform(0.01, 0.4))
        return Segment(kind, line, positions, quaternions, feed, force, dwell)

    first = (
        segment("approach", 0, 3),
        segment("process", 0, 25, force=12.5),
        segment("retract", 0, 2),
        segment("approach", 1, 2),
        segment("process", 1, 25, force=12.5),
        segment("process", 1, 7, force=20.0, dwell=0.75),
        segment("retract", 1, 1),
    )
    second = (segment("process", 3, 9, dwell=1.5),)
    own = replace(first[4], feeds_m_s=np.round(rng.uniform(0.01, 0.4, 25), 4))
    first = (*first[:4], own, *first[5:])
    return Job(
        "chair",
        "cell A",
        (
            ToolPath("seat, left (old)", "sand", "disc 125", 0.0625, first, 314.0, {"grit": 120}),
            ToolPath("Rücken; %x", "paint", "gun", 0.02, second),
        ),
    )


def small_job() -> Job:
    """One line of sanding on a bent plate, and a look at it: for the golden files.

    Rounded, so that the last bit of a sine on another machine is no drift; nothing at a tie.
    """
    x = np.array([0.1003, 0.1202, 0.1415, 0.1601])
    turns = [[20.0, 3.0 + a, 175.0 - a] for a in (0.0, 4.1, 7.3, 11.2)]
    turned = np.round(Rotation.from_euler("ZYX", turns, degrees=True).as_quat(), 8)
    positions = np.round(np.stack([x, 0.0253 + 0.36 * x, 0.4 - (x - 0.1) ** 2], axis=1), 6)
    up = positions + np.array([0.0, 0.0, 0.05])
    sanding = (
        Segment("approach", 0, np.stack([up[0], positions[0]]), turned[[0, 0]], 0.1),
        Segment("process", 0, positions, turned, 0.0333, 15.0, 0.5),
        Segment("retract", 0, np.stack([positions[3], up[3]]), turned[[3, 3]], 0.25),
    )
    looking = (Segment("process", 0, up[:2], turned[:2], 0.1),)
    return Job(
        "plate",
        "cell",
        (
            ToolPath("top", "sand", "disc 125", 0.0625, sanding, 400.0, {"grit": 120}),
            ToolPath("top", "inspect", "camera", 0.01, looking),
        ),
        # Z up, Y ahead: the quaternion has no last bit to drift.
        Similarity(np.eye(3)[[2, 0, 1]], np.array([0.13, 0.07, 0.4]), 0.06),
    )
