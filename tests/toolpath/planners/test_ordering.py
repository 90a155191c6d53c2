from itertools import pairwise

import numpy as np

from nrdf.toolpath.planners.ordering import snake_order, started_near
from nrdf.toolpath.surface_path import SurfacePath


def line(y, x0=0.0, x1=1.0):
    x = np.linspace(x0, x1, 21)
    return SurfacePath(np.stack([x, 0 * x + y, 0 * x], axis=1), np.tile([0.0, 0, 1], (21, 1)))


def test_lines_become_a_snake():
    ordered = snake_order([line(0.1), line(0.0), line(0.2)], [1, 0, 2], 0.1)
    assert [path.contacts[0, 1] for path in ordered] == [0.0, 0.1, 0.2]
    gaps = [np.linalg.norm(b.contacts[0] - a.contacts[-1]) for a, b in pairwise(ordered)]
    np.testing.assert_allclose(gaps, 0.1)


def test_one_side_of_a_hole_is_driven_whole_before_the_other():
    paths, levels = [line(0.0)], [0]
    for k in range(1, 6):
        paths += [line(0.1 * k, 0.0, 0.3), line(0.1 * k, 0.7, 1.0)]
        levels += [k, k]
    paths, levels = [*paths, line(0.6)], [*levels, 6]
    ordered = snake_order(paths, levels, 0.1)
    assert len(ordered) == 12
    air = [np.linalg.norm(b.contacts[0] - a.contacts[-1]) for a, b in pairwise(ordered)]
    assert sum(away > 0.11 for away in air) <= 2


def test_a_ring_starts_near_the_end_before():
    angle = np.linspace(0, 2 * np.pi, 37)
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    ring[-1] = ring[0]
    turned = started_near(SurfacePath(ring, ring, True), np.array([0.0, 2.0, 0.0]))
    np.testing.assert_allclose(turned.contacts[[0, -1]], [[0, 1, 0]] * 2, atol=1e-9)
    assert len(turned.contacts) == 37 and turned.closed
