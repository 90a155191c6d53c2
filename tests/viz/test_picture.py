from __future__ import annotations

import matplotlib.image
import numpy as np
import pytest

from nrdf.errors import OutputError
from nrdf.geometry.sampling import fibonacci_directions
from nrdf.viz.palette import region_colours
from nrdf.viz.picture import Panel, draw_regions, render_details, render_panels

BALL = fibonacci_directions(4000)


def drawn(tmp_path, panels, size=200):
    path = tmp_path / "picture.png"
    draw_regions(panels, path, size)
    return matplotlib.image.imread(path)[..., :3]


def like(image, colour, tolerance=0.2):
    """Pixels of a colour's hue, whatever their brightness."""
    unit = colour / np.linalg.norm(colour)
    cosine = image @ unit / np.maximum(np.linalg.norm(image, axis=-1), 1e-9)
    return (cosine > 1 - tolerance**2) & (np.ptp(image, axis=-1) > 0.15)


def test_regions_are_where_they_belong(tmp_path):
    names = ["upper", "right"]
    colours = region_colours(names)
    regions = {
        "upper": BALL[:, 1] > 0.5,
        "right": np.flatnonzero((BALL[:, 1] < 0.2) & (BALL[:, 2] > 0.5)),
    }
    image = drawn(tmp_path, [Panel("ball", BALL, BALL, regions)], 300)
    body = image[40:-60]
    upper, right = like(body, colours["upper"]), like(body, colours["right"])
    assert upper.sum() > 2000 and right.sum() > 2000
    rows, columns = np.arange(body.shape[0])[:, None], np.arange(body.shape[1])
    assert (upper * rows).sum() / upper.sum() < (right * rows).sum() / right.sum()
    assert (right * columns).sum() / right.sum() < body.shape[1] / 2


def test_surface_is_closed_and_background_white(tmp_path):
    image = drawn(tmp_path, [Panel("ball", BALL, BALL)], 300)[40:-10]
    painted = (image < 0.99).any(-1)
    rows, columns = np.nonzero(painted)
    centre = np.array([rows.min() + rows.max(), columns.min() + columns.max()]) / 2
    radius = (columns.max() - columns.min()) / 2
    grid = np.indices(painted.shape) - centre[:, None, None]
    distance = np.hypot(*grid)
    assert painted[distance < 0.96 * radius].mean() > 0.999
    assert painted[distance > 1.04 * radius].mean() < 0.001


def test_details_stand_beside_the_panel(tmp_path):
    regions = {"upper": BALL[:, 1] > 0.8, "far": BALL[:, 0] > 0.8}
    path = tmp_path / "details.png"
    draw_regions([Panel("ball", BALL, BALL, regions)], path, 200, details=True)
    image = matplotlib.image.imread(path)[..., :3]
    whole, upper, far = (image[40:-50, 200 * k : 200 * (k + 1)] for k in range(3))
    colours = region_colours(regions)
    assert image.shape[1] == 600
    assert like(upper, colours["upper"]).sum() > 2 * like(whole, colours["upper"]).sum()
    assert like(far, colours["far"]).sum() > 2 * like(whole, colours["far"]).sum()


def test_hidden_region_adds_a_view_from_where_it_is_seen(tmp_path):
    colour = region_colours(["far"])["far"]
    near = drawn(tmp_path, [Panel("ball", BALL, BALL, {"far": BALL[:, 0] > 0.8})])
    far = drawn(tmp_path, [Panel("ball", BALL, BALL, {"far": BALL[:, 0] < -0.8})])
    assert far.shape[1] == 2 * near.shape[1]  # one panel: the second view stands beside
    half = far.shape[1] // 2
    body = far[:-50]
    assert like(body[:, half:], colour).sum() > 500 > like(body[:, :half], colour).sum()
    panels = [Panel("ball", BALL, BALL, {"far": BALL[:, 0] < -0.8})] * 2
    several = drawn(tmp_path, panels)  # else below
    assert several.shape[1] == far.shape[1] and several.shape[0] > 1.5 * near.shape[0]


def test_panels_are_side_by_side_and_share_the_colours(tmp_path):
    first = Panel("a", BALL, None, {"x": BALL[:, 0] > 0.5})
    second = Panel("b", 1000 * BALL + 5, BALL, {"y": BALL[:, 0] > 0.5, "none": np.empty(0, int)})
    image = drawn(tmp_path, [first, second])
    assert image.shape[1] == 400
    colours = region_colours(["x", "y"])
    body = image[:-60]
    assert like(body[:, :200], colours["x"]).sum() > 200 > like(body[:, 200:], colours["x"]).sum()
    assert like(body[:, 200:], colours["y"]).sum() > 200 > like(body[:, :200], colours["y"]).sum()


def test_unwritable_path_is_an_output_error_and_leaves_nothing(tmp_path):
    with pytest.raises(OutputError, match=r"cannot write .*x.png"):
        draw_regions([Panel("ball", BALL, BALL)], tmp_path / "none" / "x.png", 60)
    assert list(tmp_path.iterdir()) == []


def ring(height, radius=1.0):
    angle = np.linspace(0, 2 * np.pi, 200)
    side = radius * np.sqrt(1 - height**2)
    return np.stack([side * np.cos(angle), 0 * angle + height, side * np.sin(angle)], axis=1)


def inked(lines, regions=None):
    """How many pixels of the front view change when lines are drawn on the ball."""
    regions = {"cap": BALL[:, 1] > 0.3} if regions is None else regions
    with_lines = Panel("ball", BALL, BALL, regions, "", {"cap": lines})
    plain = Panel("ball", BALL, BALL, regions, "", {"cap": [np.zeros((0, 3))]})
    first, second = (render_panels([panel], 300)[0][0][0] for panel in (with_lines, plain))
    return int((np.abs(first - second).max(axis=-1) > 0.1).sum())


def test_lines_are_drawn_on_the_side_that_is_seen():
    upper, lower = ring(0.6), ring(-0.97)
    assert inked([upper]) > 400
    assert inked([lower]) < 0.1 * inked([upper])
    assert inked([ring(0.6, 1.05)]) > 400


def test_a_line_may_dip_into_its_own_region_only():
    sunk = ring(0.6, 0.99)
    assert inked([sunk]) > 400
    assert inked([sunk], {"cap": BALL[:, 1] < -0.9}) < 100


def test_a_region_without_lines_and_lines_without_a_region_are_drawn():
    assert inked([]) == 0
    assert inked([ring(0.9)], {}) > 100


def test_details_show_each_region_from_its_side():
    colours = region_colours(["up", "back"])
    regions = {"up": BALL[:, 1] > 0.7, "back": BALL[:, 0] < -0.7}
    shown = render_details(Panel("ball", BALL, BALL, regions), ["up", "back"], 120)
    for name, image in shown.items():
        assert image.shape == (120, 120, 3)
        other = "back" if name == "up" else "up"
        assert like(image, colours[name]).sum() > 0.3 * 120 * 120
        assert like(image, colours[other]).sum() < 0.1 * 120 * 120
    empty = render_details(Panel("ball", BALL, BALL, {"up": BALL[:, 0] > 2}), ["up"], 50)["up"]
    assert (empty == 1).all()
