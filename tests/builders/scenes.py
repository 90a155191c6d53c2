"""Scans with known truth, for the tests of cleaning and alignment."""

from __future__ import annotations

from functools import cache

import numpy as np

import nrdf
from nrdf.geometry.canonical import rotation_about_up
from nrdf.geometry.similarity import Similarity, up_axis, upright
from nrdf.scans.pose_scorer import PoseScorer
from nrdf.scans.simulate import ScanSettings, SimulatedScan, simulate_scan
from nrdf.shapes.families import get_family
from nrdf.shapes.families.tessellation import Tessellation, tessellate

UP = up_axis("z")


@cache
def triangles(category: str, seed: int) -> Tessellation:
    return tessellate(get_family(category).member(seed))


def pose(yaw: float, scale: float = 1.0, offset=(0.0, 0.0, 0.0)) -> Similarity:
    return Similarity(upright(UP) @ rotation_about_up(yaw), np.array(offset, float), scale)


def scan_of(
    category: str, seed: int, place: Similarity | None = None, views: int = 3, **settings
) -> SimulatedScan:
    """A simulated scan of an unseen member, with 1 mm of noise if it were 1 m large."""
    mesh = triangles(category, seed)
    settings = {"noise": 0.001, "pixels": 150, **settings}
    return simulate_scan(
        mesh.vertices,
        mesh.faces,
        ScanSettings(views=views, **settings),
        np.random.default_rng(seed),
        place or pose(0.7),
    )


def yaw_error(found: Similarity, true: Similarity) -> float:
    """Angle (degrees) between two poses' rotations."""
    cosine = (np.trace(found.rotation.T @ true.rotation) - 1) / 2
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


@cache
def scorer(category: str) -> PoseScorer:
    """That of the zoo's model."""
    return PoseScorer(nrdf.load_model(category))


@cache
def full(category: str, seed: int, count: int = 5000):
    """The surface of a family's member, with normals and coordinates."""
    return get_family(category).member(seed).sample_surface(count, np.random.default_rng(0))
