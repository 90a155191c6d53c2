"""What clicks and drags on the objects do, by the tool in the hand."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import viser

from nrdf.errors import NrdfError
from nrdf.studio.model.document import REFERENCE
from nrdf.studio.scene.camera import Camera, inside
from nrdf.studio.scene.drawing import found
from nrdf.studio.scene.scene_view import ObjectView

if TYPE_CHECKING:
    from nrdf.studio.app import Studio

TOOLS = ("Turn", "Grow", "Brush", "Box", "Arrow", "Alike")
_BRUSH = 0.4  # radius of the brush, in radii of a patch


@dataclass(frozen=True)
class _Grown:
    """The patch grown last, which follows the radius: where, and the region (k,) before it."""

    object_view: ObjectView
    region: str
    index: int
    before: np.ndarray
    erase: bool


class Mouse:
    """The tools. erase: painting takes away; through: a box also takes what is hidden."""

    def __init__(self, studio: Studio) -> None:
        self.studio = studio
        self.tool, self.erase, self.through = TOOLS[0], False, False
        self._grown: _Grown | None = None
        self._drag: tuple[ObjectView, int] | None = None
        self._boxes = False
        studio.server.scene.on_click()(self._clicked)

    def take(self, tool: str) -> None:
        """Another tool in the hand."""
        self.tool = tool
        self.forget()
        self.grip()

    def forget(self) -> None:
        """Let the patch grown last be as it is."""
        self._grown = self._drag = None

    def grip(self) -> None:
        """Let drags go to the tool that needs them, and to the camera otherwise.

        What holds already is left alone: taking it away ends the drag that goes on.
        """
        scene = self.studio.server.scene
        boxes, drags = self.tool == "Box", self.tool in ("Brush", "Arrow", "Alike")
        if boxes != self._boxes:
            self._boxes = boxes
            if boxes:
                scene.on_rect_select()(self._boxed)
            else:
                scene.remove_rect_select_callback()
        for object_view in self.studio.scene.objects.values():
            object_view.let_drag(self._dragged if drags else None)

    def regrow(self, radius_m: float) -> None:
        """Another radius, also for the patch that was grown last."""
        self.studio.radius_m = radius_m
        grown = self._grown
        if grown is None or grown.region != self.studio.region:
            return
        patch = grown.object_view.paintable.canvas.patch(grown.index, radius_m)
        self._paint(grown.object_view, _painted(grown.before, patch, grown.erase), merge=True)
        self.studio.painted()

    def _clicked(self, event: viser.SceneClickEvent) -> None:
        with self.studio.reporting_errors():
            met = self.studio.scene.hit(np.array(event.ray_origin), np.array(event.ray_direction))
            if met is None or self.tool not in ("Grow", "Brush", "Alike"):
                return
            object_view, index = met
            if self.tool == "Alike":
                self.studio.compare(object_view.key, index)
                return
            self._check(object_view)
            before = self._current(object_view)
            wide = self.tool == "Grow"
            radius = self.studio.radius_m * (1.0 if wide else _BRUSH)
            patch = object_view.paintable.canvas.patch(index, radius)
            grown = _Grown(object_view, self.studio.region, index, before, self.erase)
            self._grown = grown if wide else None
            self._paint(object_view, _painted(before, patch, self.erase))
            self.studio.painted()

    def _boxed(self, event: viser.SceneRectSelectEvent) -> None:
        with self.studio.reporting_errors():
            corners = (event.screen_min, event.screen_max)
            view = camera_of(event.client)
            for key in self.studio.shown():
                object_view = self.studio.scene.objects[key]
                paintable = object_view.paintable
                chosen = inside(
                    object_view.view(view), paintable.points, paintable.normals, corners,
                    paintable.surface.spacing, self.through,
                )  # fmt: skip
                if chosen.any():
                    self._check(object_view)
                    self._paint(
                        object_view, _painted(self._current(object_view), chosen, self.erase)
                    )
            self.studio.painted()

    async def _dragged(self, event: viser.SceneNodeDragEvent[Any]) -> None:
        # On the event loop, so that a stroke's parts come in order.
        with self.studio.reporting_errors():
            view, stage = camera_of(event.client), self.studio.scene
            met = stage.hit(view.position, view.ray(event.end_screen_pos))
            if event.phase == "start":
                self.forget()
                self._drag = stage.hit(view.position, view.ray(event.start_screen_pos))
                if self._drag is not None and self.tool != "Alike":
                    self._check(self._drag[0])
            if self._drag is None:
                return
            object_view, first = self._drag
            index = met[1] if met is not None and met[0] is object_view else None
            if self.tool == "Alike":
                if index is not None:
                    self.studio.compare(object_view.key, index)
            elif self.tool == "Brush":
                start = event.phase == "start"
                at = [i for i in (first if start else None, index) if i is not None]
                if at:
                    patch = object_view.paintable.canvas.patch(at, _BRUSH * self.studio.radius_m)
                    mask = _painted(self._current(object_view), patch, self.erase)
                    self._paint(object_view, mask, merge=not start)
            elif index is not None and index != first and object_view.key == REFERENCE:
                self._point(object_view, first, index, event.phase == "end")
            if event.phase == "end":
                self._drag = None
                if self.tool != "Alike":
                    self.studio.painted()

    def _point(self, object_view: ObjectView, first: int, last: int, final: bool) -> None:
        start, stop = object_view.paintable.points[first], object_view.paintable.points[last]
        object_view.draw_arrow("direction", start, stop)
        if final:
            along = (stop - start) / np.linalg.norm(stop - start)
            direction = [round(float(x), 4) for x in along]
            self.studio.editor.change_step(
                self.studio.region, self.studio.step, direction=direction
            )

    def _check(self, object_view: ObjectView) -> None:
        """Raises NrdfError where there is nothing to paint."""
        self.studio.need_region()
        if object_view.key != REFERENCE and object_view.key not in self.studio.results.by_target:
            raise NrdfError(
                f"nothing has been brought to {object_view.key} yet: press 'Bring the process "
                "there' in step 4 first, then correct its regions here"
            )

    def _current(self, object_view: ObjectView) -> np.ndarray:
        """The shown points of an object that are in the region now."""
        studio = self.studio
        there = found(studio.results, object_view.key, studio.region)
        return studio.editor.mask(object_view.key, studio.region, there)

    def _paint(self, object_view: ObjectView, mask: np.ndarray, merge: bool = False) -> None:
        self.studio.editor.paint(object_view.key, self.studio.region, mask, merge)
        self.studio.draw_colours(object_view)


def camera_of(client: viser.ClientHandle) -> Camera:
    """The camera of a browser."""
    camera = client.camera
    return Camera.of(camera.position, camera.wxyz, camera.fov, camera.aspect)


def _painted(before: np.ndarray, patch: np.ndarray, erase: bool) -> np.ndarray:
    return before & ~patch if erase else before | patch
