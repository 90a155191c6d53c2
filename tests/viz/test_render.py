"""Drawing discs and lines without OpenGL."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nrdf.geometry.sampling import fibonacci_directions
from nrdf.viz.render import Scene, SurfaceLines
from nrdf.viz.view import Camera


def ball(count: int = 4000) -> Scene:
    """A ball of radius 0.5 whose upper half is region 0."""
    normals = fibonacci_directions(count)
    region = np.where(normals[:, 1] > 0, 0, -1)
    return Scene(0.5 * normals, normals, region, np.full(count, 0.02))


TABLE = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
FRONT_VIEW = Camera(0.0, 0.0).axes()


def drawn(scene: Scene) -> np.ndarray:
    """(60, 60, 3), the lowest row first."""
    return scene.render(FRONT_VIEW, np.array([-0.6, -0.6]), 50.0, (60, 60), TABLE, 0.0 * TABLE)


def test_a_ball_covers_its_circle_and_its_halves_have_their_colours():
    image = drawn(ball())
    y, x = np.indices((60, 60))
    away = np.hypot(x - 29.5, y - 29.5) / 50
    assert (image[away > 0.54] == 1.0).all()
    assert (image[away < 0.47].min(axis=-1) < 0.5).all()
    upper, lower = (away < 0.4) & (y > 35), (away < 0.4) & (y < 25)
    assert (image[upper, 0] > image[upper, 2]).all()
    assert (image[lower, 2] > image[lower, 0]).all()


def test_a_line_is_seen_in_front_of_the_ball_and_not_behind_it():
    line = np.array([[0.0, 0.2, -0.3], [0.0, 0.2, 0.3]])
    plain = drawn(ball())
    toward = 0.52 * FRONT_VIEW[2]
    for place, seen in ((line + toward, True), (line - toward, False)):
        scene = replace(ball(), lines=(SurfaceLines(0, (place,)),))
        assert (np.abs(drawn(scene) - plain).max() > 0.3) == seen
