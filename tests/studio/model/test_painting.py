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


def test_a_border_moves_by_distances_along_the_surface(chair):
    body, regions = chair
    seed = middle(body, regions["seat"])
    patch, larger = body.canvas.patch(seed, 0.08), body.canvas.patch(seed, 0.12)
    grown = body.canvas.offset(patch, 0.04)
    assert (grown & ~patch).any() and (grown & patch == patch).all()
    assert (grown ^ larger).sum() < 0.2 * larger.sum()
    assert (body.canvas.offset(grown, -0.04) ^ patch).sum() < 0.2 * patch.sum()
    none = np.zeros(len(patch), bool)
    assert not body.canvas.offset(none, 0.01).any() and body.canvas.offset(~none, -0.01).all()


def test_holes_are_filled_and_what_is_beside_is_not(chair):
    body, regions = chair
    seed = middle(body, regions["seat"])
    patch = body.canvas.patch(seed, 0.12)
    with_hole = patch & ~body.canvas.patch(seed, 0.04)
    assert with_hole.sum() < patch.sum()
    assert (body.canvas.filled(with_hole) == patch).all()
    assert (body.canvas.filled(patch) == patch).all()


def test_a_ragged_border_becomes_smooth(chair):
    body, regions = chair
    seed = middle(body, regions["seat"])
    patch = body.canvas.patch(seed, 0.12)
    rim = np.flatnonzero(body.canvas.offset(patch, 0.02) & ~body.canvas.offset(patch, -0.02))
    ragged = patch.copy()
    flipped = np.random.default_rng(0).permutation(rim)[: len(rim) // 4]
    ragged[flipped] ^= True
    smooth = body.canvas.smoothed(ragged)
    assert (smooth ^ patch).sum() < 0.6 * (ragged ^ patch).sum()


def test_painting_8192_points_takes_less_than_100_ms(chair):
    from nrdf.studio.scene.colours import painted_colours

    body, regions = chair
    seed = middle(body, regions["seat"])
    body.canvas.patch(seed, 0.2)
    start = time.process_time()
    patch = body.canvas.patch(seed, 0.2)
    painted_colours(len(patch), [((200, 100, 0), np.flatnonzero(patch), None)])
    assert time.process_time() - start < 0.05
