"""What clicks and drags on the objects do, by the selected tool."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import viser

from nrdf.errors import NrdfError
from nrdf.studio.context import StudioContext
from nrdf.studio.model.document import REFERENCE
from nrdf.studio.scene.camera import Camera, points_in_outline, points_in_rectangle
from nrdf.studio.scene.drawing import about_point, found_indices
from nrdf.studio.scene.object_view import ObjectView
from nrdf.studio.tools import ACTS, ERASE, TOOLS, tool

_BRUSH = 0.4  # radius of the brush, in radii of a patch


@dataclass(frozen=True)
class _GrownPatch:
    """The patch grown last, which follows the radius: where, and the region (k,) before it."""

    object_view: ObjectView
    region: str
    index: int
    before: np.ndarray
    erase: bool


@dataclass(frozen=True)
class _MovedBorder:
    """A border that was moved by millimetres: from what region (k,), by how much, m, to which."""

    before: np.ndarray
    by_m: float
    after: np.ndarray


class Mouse:
    """The tools. erase: painting takes away; through: a rectangle also takes hidden points."""

    def __init__(self, context: StudioContext) -> None:
        self.context = context
        self.tool, self.erase, self.through = TOOLS[0].name, False, False
        self._grown: _GrownPatch | None = None
        self._drag: tuple[ObjectView, int] | None = None
        self._painted = REFERENCE
        self._moved: _MovedBorder | None = None
        self._selects_boxes = False
        self._measured: tuple[ObjectView, int] | None = None
        self.measured = ""
        """What was measured last, in Markdown."""
        context.server.scene.on_click()(self._clicked)

    def select_tool(self, name: str) -> None:
        """Take another tool. Raises KeyError for one that there is not."""
        self.tool = tool(name).name
        self.forget_patch()
        self._forget_measure()
        self.update_callbacks()

    def forget_patch(self) -> None:
        """Let the patch grown last no longer follow the radius."""
        self._grown = self._drag = None

    def update_callbacks(self) -> None:
        """Let drags go to the tool where it needs them, else to the camera.

        Callbacks that are set already are left alone: removing one ends the drag under way.
        """
        scene = self.context.server.scene
        boxes, drags = self.tool == "Rectangle", self.tool in ("Brush", "Direction", "Similarity")
        if boxes != self._selects_boxes:
            self._selects_boxes = boxes
            if boxes:
                scene.on_rect_select()(self._boxed)
            else:
                scene.remove_rect_select_callback()
        for object_view in self.context.scene.objects.values():
            object_view.set_drag_callback(self._dragged if drags else None)

    def set_radius(self, radius_m: float) -> None:
        """Set the radius of patches, also of the one grown last."""
        self.context.radius_m = radius_m
        grown = self._grown
        if grown is None or grown.region != self.context.region:
            return
        patch = grown.object_view.paintable.canvas.patch(grown.index, radius_m)
        self._paint(grown.object_view, _painted(grown.before, patch, grown.erase), merge=True)
        self.context.regions_changed()

    def act(self, name: str) -> None:
        """Erase from now on, or not; or do one of `ACTS` to the selected region, on the object that
        was painted on last. Raises NrdfError where there is nothing to do it to."""
        if name == ERASE.name:
            self.erase = not self.erase
            return
        self.context.need_region()
        keys = self.context.editor.object_keys()
        view = self.context.scene.objects[self._painted if self._painted in keys else REFERENCE]
        self._check(view)
        mask, canvas = self._current(view), view.paintable.canvas
        if not mask.any():
            raise NrdfError(f"{self.context.region} has no points yet: paint some first")
        self.forget_patch()
        if name == ACTS[0].name:
            mask = canvas.filled(mask)
        elif name == ACTS[1].name:
            mask = canvas.smoothed(mask)
        else:
            mask = self._moved_border(view, mask, 1e-3 if name == ACTS[3].name else -1e-3)
        self._paint(view, mask)
        self.context.regions_changed()

    def _moved_border(self, view: ObjectView, mask: np.ndarray, by_m: float) -> np.ndarray:
        """Points lie farther apart than a millimetre, so moves in a row count from the first."""
        moved = self._moved
        if moved is None or not np.array_equal(moved.after, mask):
            moved = _MovedBorder(mask, 0.0, mask)
        total = moved.by_m + by_m
        after = view.paintable.canvas.offset(moved.before, total) if total else moved.before
        self._moved = _MovedBorder(moved.before, total, after)
        return after

    def select_outline(self, client: viser.ClientHandle, outline: np.ndarray) -> None:
        """Paint the points that a browser shows within an outline (m, 2) of its screen."""
        camera = camera_of(client)
        self._select(lambda view: points_in_outline(
            view.camera(camera), view.paintable.points, view.paintable.normals, outline,
            view.paintable.surface.spacing,
        ))  # fmt: skip

    def under(self, camera: Camera, screen: tuple[float, float]) -> str:
        """What is seen at a place of the screen, in Markdown; "" for nothing."""
        context = self.context
        hit = context.scene.hit(camera.position, camera.ray(screen))
        if hit is None:
            return ""
        return about_point(context.editor, context.results, hit[0].key, hit[1])

    def _clicked(self, event: viser.SceneClickEvent) -> None:
        context = self.context
        with context.reporting_errors():
            hit = context.scene.hit(np.array(event.ray_origin), np.array(event.ray_direction))
            if hit is None or self.tool not in ("Grow", "Brush", "Similarity", "Measure"):
                return
            object_view, index = hit
            if self.tool == "Measure":
                self._measure(object_view, index)
                return
            if self.tool == "Similarity":
                context.compare(object_view.key, index)
                return
            self._check(object_view)
            before = self._current(object_view)
            grows = self.tool == "Grow"
            radius = context.radius_m * (1.0 if grows else _BRUSH)
            patch = object_view.paintable.canvas.patch(index, radius)
            grown = _GrownPatch(object_view, context.region, index, before, self.erase)
            self._grown = grown if grows else None
            self._paint(object_view, _painted(before, patch, self.erase))
            context.regions_changed()

    def _measure(self, object_view: ObjectView, index: int) -> None:
        """Say where a point is; every second one also how far it is from the first."""
        context, first = self.context, self._measured
        self.measured = about_point(context.editor, context.results, object_view.key, index)
        if first is None or first[0] is not object_view:
            self._forget_measure(keep=self.measured)
            self._measured = object_view, index
        else:
            start, stop = object_view.paintable.points[[first[1], index]]
            object_view.draw_arrow("measure", start, stop)
            self.measured += f"  \n**{1e3 * np.linalg.norm(stop - start):.1f} mm** from the first"
            self._measured = None
        context.refresh_panel()

    def _forget_measure(self, keep: str = "") -> None:
        self._measured, self.measured = None, keep
        for object_view in self.context.scene.objects.values():
            object_view.draw_arrow("measure", None, None)

    def _boxed(self, event: viser.SceneRectSelectEvent) -> None:
        with self.context.reporting_errors():
            corners = (event.screen_min, event.screen_max)
            camera = camera_of(event.client)
            self._select(lambda view: points_in_rectangle(
                view.camera(camera), view.paintable.points, view.paintable.normals, corners,
                view.paintable.surface.spacing, self.through,
            ))  # fmt: skip

    def _select(self, chosen_of: Callable[[ObjectView], np.ndarray]) -> None:
        """Paint on every visible object what `chosen_of` it gives, (k,) bool."""
        for key in self.context.visible_objects():
            view = self.context.scene.objects[key]
            chosen = chosen_of(view)
            if chosen.any():
                self._check(view)
                self._paint(view, _painted(self._current(view), chosen, self.erase))
        self.context.regions_changed()

    async def _dragged(self, event: viser.SceneNodeDragEvent[Any]) -> None:
        # On the event loop, so that the parts of a drag come in order.
        with self.context.reporting_errors():
            camera, scene = camera_of(event.client), self.context.scene
            hit = scene.hit(camera.position, camera.ray(event.end_screen_pos))
            if event.phase == "start":
                self.forget_patch()
                self._drag = scene.hit(camera.position, camera.ray(event.start_screen_pos))
                if self._drag is not None and self.tool != "Similarity":
                    self._check(self._drag[0])
            if self._drag is None:
                return
            object_view, first = self._drag
            index = hit[1] if hit is not None and hit[0] is object_view else None
            if self.tool == "Similarity":
                if index is not None:
                    self.context.compare(object_view.key, index)
            elif self.tool == "Brush":
                start = event.phase == "start"
                seeds = [i for i in (first if start else None, index) if i is not None]
                if seeds:
                    radius = _BRUSH * self.context.radius_m
                    patch = object_view.paintable.canvas.patch(seeds, radius)
                    mask = _painted(self._current(object_view), patch, self.erase)
                    self._paint(object_view, mask, merge=not start)
            elif index is not None and index != first and object_view.key == REFERENCE:
                self._set_direction(object_view, first, index, event.phase == "end")
            if event.phase == "end":
                self._drag = None
                if self.tool != "Similarity":
                    self.context.regions_changed()

    def _set_direction(self, object_view: ObjectView, first: int, last: int, final: bool) -> None:
        start, stop = object_view.paintable.points[first], object_view.paintable.points[last]
        object_view.draw_arrow("direction", start, stop)
        if final:
            unit = (stop - start) / np.linalg.norm(stop - start)
            direction = [round(float(x), 4) for x in unit]
            context = self.context
            context.editor.change_step(context.region, context.step, direction=direction)

    def _check(self, object_view: ObjectView) -> None:
        """Raises NrdfError where there is nothing to paint."""
        self.context.need_region()
        key = object_view.key
        if key != REFERENCE and key not in self.context.results.by_target:
            raise NrdfError(
                f"nothing is transferred to {key} yet: press 'Transfer the process' in step 4 "
                "first, then correct its regions here"
            )

    def _current(self, object_view: ObjectView) -> np.ndarray:
        """Which shown points (k,) of an object are in the selected region now."""
        context, key = self.context, object_view.key
        found = found_indices(context.results, key, context.region)
        return context.editor.mask(key, context.region, found)

    def _paint(self, object_view: ObjectView, mask: np.ndarray, merge: bool = False) -> None:
        self._painted = object_view.key
        self.context.editor.paint(object_view.key, self.context.region, mask, merge)
        self.context.draw_colours(object_view)


def camera_of(client: viser.ClientHandle) -> Camera:
    """The camera of a browser."""
    camera = client.camera
    return Camera.of(camera.position, camera.wxyz, camera.fov, camera.aspect)


def _painted(before: np.ndarray, patch: np.ndarray, erase: bool) -> np.ndarray:
    return before & ~patch if erase else before | patch
