"""The mouse tools, by their events."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from builders.studio_page import face, small_box
from nrdf.studio.model.document import REFERENCE
from nrdf.studio.scene.camera import Camera
from nrdf.studio.scene.drawing import about_point


def test_a_drag_goes_on_while_work_ends(page, monkeypatch):
    """Taking callbacks away would end the drag that is under way, and orbit the camera."""
    taken_away = []
    ground = page.studio.scene.objects[REFERENCE].drag_box
    take_away = type(ground).remove_drag_callback

    def remove_drag_callback(handle, *words):
        taken_away.append(handle)
        take_away(handle, *words)

    monkeypatch.setattr(type(ground), "remove_drag_callback", remove_drag_callback)
    page.does(page.studio.mouse.select_tool, "Brush")
    assert ground.visible
    page.does(page.studio.sync)
    page.does(page.studio.mouse.select_tool, "Direction")
    assert not taken_away
    page.does(page.studio.mouse.select_tool, "Orbit")
    assert ground in taken_away and not ground.visible


def click(page, face_name):
    """A click on the middle of a box's face."""
    view = page.studio.scene.objects[REFERENCE]
    chosen = np.flatnonzero(face(small_box(), face_name))
    points = view.paintable.points[chosen]
    index = chosen[np.argmin(np.linalg.norm(points - points.mean(axis=0), axis=1))]
    scale = page.studio.scene.units_per_m
    normal, point = view.paintable.normals[index], view.paintable.points[index]
    origin = point * scale + view.offset + 2.0 * normal
    event = SimpleNamespace(ray_origin=tuple(origin), ray_direction=tuple(-normal))
    page.does(page.studio.mouse._clicked, event)
    return int(index)


def test_a_patch_grows_where_it_is_clicked_and_follows_the_radius(page):
    page.paint("top", [])
    click(page, "top")
    assert not page.editor.document.region("top").mask.any(), "Orbit does not paint"
    page.does(page.studio.mouse.select_tool, "Grow")
    page.studio.radius_m = 0.1
    index = click(page, "top")
    small = page.editor.document.region("top").mask
    assert small[index] and not small[face(small_box(), "front")].any()
    page.does(page.studio.mouse.set_radius, 0.2)
    assert page.editor.document.region("top").mask.sum() > 2 * small.sum()
    page.studio.mouse.erase = True
    click(page, "top")
    assert not page.editor.document.region("top").mask[index]


def test_a_target_without_a_result_is_not_painted(page):
    page.does(page.studio.mouse.select_tool, "Grow")
    view = page.studio.scene.objects["new"]
    assert "nothing is transferred to new yet" in page.does(page.studio.mouse._check, view)


def test_two_clicks_measure(page):
    mouse, hint = page.studio.mouse, page.studio.panel.hint
    page.does(page.studio.panel._take, "Measure", None)
    points = page.studio.scene.objects[REFERENCE].paintable.points
    before = page.editor.document
    one = click(page, "top")
    x, y, z = 1e3 * points[one]
    assert f"reference: **top**, x {x:.1f}, y {y:.1f}, z {z:.1f} mm" in hint.content
    other = click(page, "front")
    assert f"**{1e3 * np.linalg.norm(points[one] - points[other]):.1f} mm**" in hint.content
    assert "measure" in page.studio.scene.objects[REFERENCE]._arrows
    click(page, "top")
    assert "from the first" not in hint.content, "the next one begins anew"
    assert not page.studio.scene.objects[REFERENCE]._arrows.get("measure")
    page.does(mouse.select_tool, "Orbit")
    assert mouse.measured == "" and page.editor.document is before


def test_a_point_of_a_target_has_a_confidence(page):
    page.transfer()
    result = page.studio.results.by_target["new"].transfer_result.regions["top"].match
    index = int(result.indices[0])
    said = about_point(page.editor, page.studio.results, "new", index)
    assert f"**top** (confidence {result.confidence[0]:.2f})" in said


def test_acts_change_the_region_and_count_millimetres_from_the_first(page):
    mouse = page.studio.mouse
    page.does(mouse.select_tool, "Grow")
    page.paint("top", [])
    assert "top has no points yet" in page.does(mouse.act, "Fill holes")
    page.studio.radius_m = 0.06
    click(page, "top")
    first = page.editor.document.region("top").mask
    for _ in range(12):
        with page.studio.reporting_errors():
            mouse.act("+1 mm")
    wider = page.editor.document.region("top").mask
    assert wider.sum() > first.sum() and wider[first].all()
    for _ in range(12):
        with page.studio.reporting_errors():
            mouse.act("−1 mm")
    assert (page.editor.document.region("top").mask == first).all()
    assert page.studio.worker.wait(60)
    page.does(page.studio.panel.take, "Erase")
    assert mouse.erase and "It takes away" in page.studio.panel.hint.content


def test_a_lasso_takes_what_is_seen_within_it_and_hovering_says_what_is_there(page, monkeypatch):
    mouse, view = page.studio.mouse, page.studio.scene.objects[REFERENCE]
    above = view.offset + page.studio.scene.units_per_m * view.paintable.points.mean(axis=0)
    camera = Camera(above + np.array([0.0, 4.0, 0.0]), looking_down(), 0.8, 1.0)
    monkeypatch.setattr("nrdf.studio.mouse.camera_of", lambda client: camera)
    page.paint("top", [])
    page.does(
        mouse.select_outline, None, np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    )
    top = face(small_box(), "top")
    mask = page.editor.document.region("top").mask
    assert mask[top].mean() > 0.95 and mask[~top].mean() < 0.05
    assert mouse.under(camera, (0.5, 0.5)).startswith("reference: **top**")
    assert mouse.under(camera, (0.99, 0.01)) == ""


def looking_down():
    """Axes of a camera that looks along -Y: x to the right, y down, z forward, as columns."""
    return np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
