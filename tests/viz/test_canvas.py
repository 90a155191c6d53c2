from __future__ import annotations

import numpy as np
import pytest

from nrdf.viz.canvas import Canvas, counted

INK = np.zeros(3, np.float32)


def canvas(depth: float = 0.0) -> Canvas:
    """A white square of 1 by 1, 100 pixels wide, with a surface of one depth."""
    image = np.ones((100, 100, 3), np.float32)
    return Canvas(image, np.full((100, 100), depth), np.eye(3), np.zeros(2), 100.0)


def dark(drawn: Canvas) -> np.ndarray:
    return drawn.image[..., 0] < 0.5


LINE = np.array([[0.2, 0.5, 0.1], [0.8, 0.5, 0.1]])


def test_a_line_is_drawn_as_wide_and_long_as_it_is():
    drawn = canvas()
    drawn.lines([LINE], None, INK, 2.0)
    rows, columns = np.nonzero(dark(drawn))
    assert rows.min() == 48 and rows.max() == 52
    assert columns.min() == 18 and columns.max() == 82


@pytest.mark.parametrize(
    ("depth", "normal", "seen"), [(0, 1, True), (0.2, 1, False), (0, -1, False)]
)
def test_a_line_behind_the_surface_or_on_its_other_side_is_not_drawn(depth, normal, seen):
    drawn = canvas(depth)
    drawn.lines([LINE], [np.tile([0.0, 0.0, normal], (2, 1))], INK, 1.0)
    drawn.arrows([LINE], [np.tile([0.0, 0.0, normal], (2, 1))], INK, 1.0)
    assert dark(drawn).any() == seen


def test_arrows_point_the_way_the_line_is_driven():
    for line, sign in ((LINE, 1), (LINE[::-1], -1)):
        drawn = canvas()
        drawn.arrows([line], [np.tile([0.0, 0.0, 1.0], (2, 1))], INK, 0.0)
        heads = np.nonzero(dark(drawn))
        middle = np.abs(heads[0] - 50) < 1
        # A head is narrow where it points to.
        first = heads[1][middle & (heads[1] < 50)]
        wings = heads[1][~middle & (heads[1] < 50)]
        assert sign * (first.mean() - wings.mean()) > 0


def test_what_is_outside_the_image_is_cut_off():
    drawn = canvas()
    drawn.segments(np.array([[[-1.0, 0.5, 0.1], [0.1, 0.5, 0.1]]]), INK, 1.0, 0.6)
    assert drawn.image[50, 0, 0] == pytest.approx(0.4) and (drawn.image[50, 20:] == 1.0).all()


def test_counted():
    index, number = counted(np.array([2, 0, 1]), np.array([5, 6, 7]))
    assert index.tolist() == [0, 0, 2] and number.tolist() == [5, 6, 7]
