from __future__ import annotations

import numpy as np
import pytest

from nrdf.geometry.mesh import Mesh
from nrdf.viz.mesh_render import MeshScene
from nrdf.viz.picture import Panel, draw_regions, render_details
from nrdf.viz.view import Camera

AXES = Camera(0.0, 0.0).axes()  # looks along -X: right is -Z, up is +Y
TABLE = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
INK = np.array([[0.0, 0.0, 0.0]] * 3)


def box(size=(1.0, 1.0, 1.0), middle=(0.0, 0.0, 0.0)) -> Mesh:
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * 0.5
    faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
             (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]  # fmt: skip
    return Mesh(corners * size + middle, np.array(faces))


def of_faces(mesh: Mesh, chosen: list[int]) -> Mesh:
    return Mesh(mesh.vertices, mesh.faces[chosen])


def drawn(scene: MeshScene, axes=AXES) -> np.ndarray:
    """(80, 80, 3), the lowest row first, 50 pixels for a unit."""
    return scene.render(axes, np.array([-0.8, -0.8]), 50.0, (80, 80), TABLE, INK)


FRONT, BACK = [2, 3], [0, 1]  # +X, -X


def test_a_box_fills_its_outline_exactly_and_the_background_is_white():
    image = drawn(MeshScene.of(box(), [], {}))
    painted = (image < 0.99).any(-1)
    assert painted[15:65, 15:65].all()
    assert painted.sum() <= 52 * 52  # with its edges


def test_a_region_is_seen_in_its_colour_from_its_side_alone():
    mesh = box(size=(0.002, 1.0, 1.0))  # a thin sheet
    for faces, seen in ((FRONT, 0), (BACK, 2)):
        image = drawn(MeshScene.of(mesh, [(0, of_faces(mesh, faces))], {}))
        assert (image[25:55, 25:55].argmax(-1) == seen).all()


def test_the_region_that_comes_last_is_on_top():
    mesh = box()
    front = of_faces(mesh, FRONT)
    image = drawn(MeshScene.of(mesh, [(0, front), (1, front)], {}))
    assert (image[25:55, 25:55].argmax(-1) == 1).all()


@pytest.mark.parametrize(("x", "seen"), [(0.5, True), (-0.5, False)])
def test_a_line_behind_the_object_is_not_drawn(x, seen):
    mesh, line = box(), np.array([[x, 0.0, -0.3], [x, 0.0, 0.3]])
    plain = drawn(MeshScene.of(mesh, [], {}))
    image = drawn(MeshScene.of(mesh, [], {0: [line]}))
    assert (np.abs(image - plain)[30:50, 25:55].max() > 0.3) == seen


def test_a_line_does_not_shine_through_a_sheet_without_thickness():
    mesh = Mesh(box().vertices * (0.0, 1.0, 1.0), box().faces[[*BACK, *FRONT]])
    line = np.array([[0.0, 0.0, -0.3], [0.0, 0.0, 0.3]])
    back = of_faces(mesh, [0, 1])
    for view, seen in ((AXES, False), (Camera(np.pi, 0.0).axes(), True)):
        plain, image = (
            drawn(MeshScene.of(mesh, [(0, back)], lines), view) for lines in ({}, {0: [line]})
        )
        assert (np.abs(image - plain)[20:60, 20:60].max() > 0.3) == seen


def test_what_is_nearer_hides_what_is_behind():
    far, near = box(), box(size=(0.1, 0.4, 0.4), middle=(0.7, 0.0, 0.0))
    both = Mesh(
        np.concatenate([far.vertices, near.vertices]), np.concatenate([far.faces, near.faces + 8])
    )
    region = Mesh(far.vertices, far.faces)
    image = drawn(MeshScene.of(both, [(0, region)], {}))
    assert image[40, 40].argmax() == 2 and image[20, 20].argmax() == 0


def test_a_picture_of_a_mesh_and_close_ones_of_its_regions(tmp_path):
    mesh = box(size=(300.0, 400.0, 500.0), middle=(40.0, 0.0, 7.0))
    front = of_faces(mesh, FRONT)
    line = np.array([[190.0, 0.0, -150.0], [190.0, 0.0, 150.0]])
    panel = Panel.of_mesh(
        "box", mesh, {"front": front}, {"front": [line]}, [line + np.array([50.0, 0.0, 0.0])]
    )
    draw_regions([panel], tmp_path / "box.png", 200)
    assert (tmp_path / "box.png").stat().st_size > 1000
    close = render_details(panel, ["front"], 120)["front"]
    assert close.shape == (120, 120, 3)
    assert (np.ptp(close, axis=-1) > 0.1).mean() > 0.4  # the region's colour fills it
