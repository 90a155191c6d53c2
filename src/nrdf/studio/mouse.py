"""What clicks and drags on the objects do, by the tool in the hand."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import viser

from nrdf.errors import NrdfError
from nrdf.studio.document import REFERENCE
from nrdf.studio.drawing import found
from nrdf.studio.scene_view import Figure
from nrdf.studio.view import View, inside

if TYPE_CHECKING:
    from nrdf.studio.app import Studio

TOOLS = ("Turn", "Grow", "Brush", "Box", "Arrow", "Alike")
_BRUSH = 0.4  # radius of the brush, in radii of a patch


@dataclass(frozen=True)
class _Grown:
    """The patch grown last, which follows the radius: where, and the region (k,) before it."""

    figure: Figure
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
        self._drag: tuple[Figure, int] | None = None
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
        for figure in self.studio.stage.figures.values():
            figure.let_drag(self._dragged if drags else None)

    def regrow(self, radius_m: float) -> None:
        """Another radius, also for the patch that was grown last."""
        self.studio.radius_m = radius_m
        grown = self._grown
        if grown is None or grown.region != self.studio.region:
            return
        patch = grown.figure.body.canvas.patch(grown.index, radius_m)
        self._paint(grown.figure, _painted(grown.before, patch, grown.erase), merge=True)
        self.studio.painted()

    def _clicked(self, event: viser.SceneClickEvent) -> None:
        with self.studio.answering():
            met = self.studio.stage.hit(np.array(event.ray_origin), np.array(event.ray_direction))
            if met is None or self.tool not in ("Grow", "Brush", "Alike"):
                return
            figure, index = met
            if self.tool == "Alike":
                self.studio.compare(figure.key, index)
                return
            self._check(figure)
            before = self._current(figure)
            wide = self.tool == "Grow"
            radius = self.studio.radius_m * (1.0 if wide else _BRUSH)
            patch = figure.body.canvas.patch(index, radius)
            grown = _Grown(figure, self.studio.region, index, before, self.erase)
            self._grown = grown if wide else None
            self._paint(figure, _painted(before, patch, self.erase))
            self.studio.painted()

    def _boxed(self, event: viser.SceneRectSelectEvent) -> None:
        with self.studio.answering():
            corners = (event.screen_min, event.screen_max)
            view = view_of(event.client)
            for key in self.studio.shown():
                figure = self.studio.stage.figures[key]
                body = figure.body
                chosen = inside(
                    figure.view(view), body.points, body.normals, corners,
                    body.surface.spacing, self.through,
                )  # fmt: skip
                if chosen.any():
                    self._check(figure)
                    self._paint(figure, _painted(self._current(figure), chosen, self.erase))
            self.studio.painted()

    async def _dragged(self, event: viser.SceneNodeDragEvent[Any]) -> None:
        # On the event loop, so that a stroke's parts come in order.
        with self.studio.answering():
            view, stage = view_of(event.client), self.studio.stage
            met = stage.hit(view.position, view.ray(event.end_screen_pos))
            if event.phase == "start":
                self.forget()
                self._drag = stage.hit(view.position, view.ray(event.start_screen_pos))
                if self._drag is not None and self.tool != "Alike":
                    self._check(self._drag[0])
            if self._drag is None:
                return
            figure, first = self._drag
            index = met[1] if met is not None and met[0] is figure else None
            if self.tool == "Alike":
                if index is not None:
                    self.studio.compare(figure.key, index)
            elif self.tool == "Brush":
                start = event.phase == "start"
                at = [i for i in (first if start else None, index) if i is not None]
                if at:
                    patch = figure.body.canvas.patch(at, _BRUSH * self.studio.radius_m)
                    mask = _painted(self._current(figure), patch, self.erase)
                    self._paint(figure, mask, merge=not start)
            elif index is not None and index != first and figure.key == REFERENCE:
                self._point(figure, first, index, event.phase == "end")
            if event.phase == "end":
                self._drag = None
                if self.tool != "Alike":
                    self.studio.painted()

    def _point(self, figure: Figure, first: int, last: int, final: bool) -> None:
        start, stop = figure.body.points[first], figure.body.points[last]
        figure.draw_arrow("direction", start, stop)
        if final:
            along = (stop - start) / np.linalg.norm(stop - start)
            direction = [round(float(x), 4) for x in along]
            self.studio.desk.change_step(self.studio.region, self.studio.step, direction=direction)

    def _check(self, figure: Figure) -> None:
        """Raises NrdfError where there is nothing to paint."""
        self.studio.need_region()
        if figure.key != REFERENCE and figure.key not in self.studio.bench.results:
            raise NrdfError(
                f"nothing has been brought to {figure.key} yet: press 'Bring the process there' in "
                "step 4 first, then correct its regions here"
            )

    def _current(self, figure: Figure) -> np.ndarray:
        """The shown points of an object that are in the region now."""
        studio = self.studio
        there = found(studio.bench, figure.key, studio.region)
        return studio.desk.mask(figure.key, studio.region, there)

    def _paint(self, figure: Figure, mask: np.ndarray, merge: bool = False) -> None:
        self.studio.desk.paint(figure.key, self.studio.region, mask, merge)
        self.studio.draw_colours(figure)


def view_of(client: viser.ClientHandle) -> View:
    """The camera of a browser."""
    camera = client.camera
    return View.of(camera.position, camera.wxyz, camera.fov, camera.aspect)


def _painted(before: np.ndarray, patch: np.ndarray, erase: bool) -> np.ndarray:
    return before & ~patch if erase else before | patch
