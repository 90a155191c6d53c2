"""Painting: patches along the surface, and mirror images."""

from __future__ import annotations

import time

import numpy as np
import pytest

from nrdf.bundled import bundled_chair
from nrdf.studio.model.paintable_cloud import PaintableCloud


@pytest.fixture(scope="module")
def chair():
    cloud, regions = bundled_chair("reference")
    return PaintableCloud(cloud), regions


def middle(body, mask):
    points = body.points[mask]
    return int(
        np.flatnonzero(mask)[np.argmin(np.linalg.norm(points - points.mean(axis=0), axis=1))]
    )


def test_a_patch_is_round_on_what_is_flat_and_does_not_go_through(chair):
    body, regions = chair
    seed = middle(body, regions["back-front"])
    patch = body.canvas.patch(seed, 0.1)
    away = np.linalg.norm(body.points - body.points[seed], axis=1)
    front = regions["back-front"]
    assert not (patch & regions["back-back"]).any()
    assert patch[front & (away < 0.09)].all() and not patch[away > 0.1].any()


def test_ways_lead_around_what_is_thin(chair):
    body, regions = chair
    seed = middle(body, regions["back-front"])
    behind = regions["back-back"] & (np.linalg.norm(body.points - body.points[seed], axis=1) < 0.04)
    assert behind.any() and (body.canvas.distances(seed, 0.15)[behind] > 0.15).all()


def test_a_stroke_is_near_any_of_its_points(chair):
    body, regions = chair
    first = middle(body, regions["seat"])
    second = middle(body, regions["back-front"])
    both = body.canvas.patch([first, second], 0.05)
    one, other = (body.canvas.patch(seed, 0.05) for seed in (first, second))
    assert (both == (one | other)).all() and one.any() and other.any()


def test_the_mirror_image_is_on_the_other_side(chair):
    body, regions = chair
    left = regions["armrests"] & (body.points[:, 2] < 0)
    other = body.canvas.mirrored(left)
    right = regions["armrests"] & (body.points[:, 2] > 0)
    assert (other & right).sum() > 0.85 * right.sum()
    assert (other & ~regions["armrests"]).sum() < 0.15 * right.sum()
    assert not body.canvas.mirrored(np.zeros(len(left), bool)).any()


def test_painting_8192_points_takes_less_than_100_ms(chair):
    from nrdf.studio.scene.colours import painted_colours

    body, regions = chair
    seed = middle(body, regions["seat"])
    body.canvas.patch(seed, 0.2)
    start = time.process_time()
    patch = body.canvas.patch(seed, 0.2)
    painted_colours(len(patch), [((200, 100, 0), np.flatnonzero(patch), None)])
    assert time.process_time() - start < 0.05
