"""A robot arm in the scene, at work on one object."""

from __future__ import annotations

import numpy as np
import viser

from nrdf.geometry.canonical import rotation_about_up
from nrdf.geometry.frames import quaternions_wxyz
from nrdf.studio.model.playback import EVERY_PATH, FLOOR, Playback
from nrdf.studio.scene.object_view import ObjectView

_CELL = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""From the cell's frame, z up, to the scene's, y up; the object's x stays x."""
_UNREACHED = (215, 20, 20)
_ACTIVE = np.array([214, 0, 170], np.uint8)
"""Colour of the line that is worked on."""
_ACTIVE_LIFT = 1.5  # of that line above the object, in lifts of the others
_UNREACHED_SIZE = 1.2  # of a point that is not reached, in spacings
_THICKNESS_M = (-0.08, 0.08)  # around the arm's frames, which have no thickness
_EVERY = 25  # every 25th moment is enough to place the camera


class ArmView:
    """The arm, its tool and what they stand on. The object turns with its turntable."""

    def __init__(self, object_view: ObjectView, playback: Playback) -> None:
        self.object_view, self.playback = object_view, playback
        self._factor = object_view.units_per_m
        self._scene = object_view.server.scene
        wxyz = quaternions_wxyz(_CELL)
        self._root = self._scene.add_frame("/arm", show_axes=False, wxyz=wxyz)
        self._bodies: dict[int, viser.FrameHandle] = {}
        self._tools: dict[int, list[viser.MeshHandle]] = {}
        for number, shape in enumerate(playback.shapes):
            parent = "/arm" if shape.body == FLOOR else self._body(shape.body)
            mesh = self._scene.add_mesh_simple(
                f"{parent}/shape{number}",
                shape.vertices * self._factor,
                shape.faces,
                color=shape.colour,
                cast_shadow=False,
                receive_shadow=False,
            )
            if shape.path != EVERY_PATH:
                self._tools.setdefault(shape.path, []).append(mesh)
        paintable = object_view.paintable
        self._marks = self._scene.add_point_cloud(
            f"{object_view.path}/unreached",
            (playback.unreached * self._factor).astype(np.float32),
            np.full((len(playback.unreached), 3), _UNREACHED, np.uint8),
            point_size=_UNREACHED_SIZE * paintable.surface.spacing * self._factor,
            point_shape="circle",
            precision="float32",
        )
        self._index = -1
        self._active: tuple[int, int] | None = None
        self._active_line: viser.SceneNodeHandle | None = None
        self.place(object_view.offset)

    @property
    def occupied_points(self) -> np.ndarray:
        """Points (k, 3) in the scene that the arm occupies at work, with the foot of its base."""
        playback = self.playback
        at_work = playback.positions[playback.motion == "process"][::_EVERY].reshape(-1, 3)
        around = np.array(
            [[x, y, z] for x in _THICKNESS_M for y in _THICKNESS_M for z in _THICKNESS_M]
        )
        foot = playback.positions[0, 0] * [1.0, 1.0, 0.0]
        taken = np.concatenate([(at_work[:, None] + around).reshape(-1, 3), [foot]])
        return taken @ _CELL.T * self._factor + self._origin

    def place(self, offset: np.ndarray) -> None:
        """Place the arm so that the object, not turned, is at `offset` (3,) in the scene."""
        place = _CELL @ self.playback.T_cell_object[:3, 3] * self._factor
        self._object, self._origin = place, offset - place
        self._upright = _CELL @ self.playback.T_cell_object[:3, :3]
        self._root.position = tuple(self._origin)
        self.show(max(self._index, 0))

    def show(self, index: int) -> None:
        """Show the moment of that index."""
        playback = self.playback
        angle = float(playback.turntable_rad[index])
        # The turntable's axis goes through the cell's origin.
        turn = rotation_about_up(angle)
        self.object_view.place(self._origin + turn @ self._object, turn @ self._upright)
        for body, frame in self._bodies.items():
            frame.position = tuple(playback.positions[index, body] * self._factor)
            frame.wxyz = tuple(playback.quaternions_wxyz[index, body])
        for path, tools in self._tools.items():
            for mesh in tools:
                mesh.visible = path == playback.path[index]
        self._highlight(int(playback.path[index]), int(playback.line[index]))
        self._index = index

    def _highlight(self, path: int, line: int) -> None:
        """Draw the line that is worked on thick; none between lines."""
        if self._active == (path, line):
            return
        if self._active_line is not None:
            self._active_line.remove()
        self._active, self._active_line = (path, line), None
        parts = [part for part in self.playback.lines[path].get(line, []) if len(part) > 1]
        if parts:
            drawn = [self.object_view.lifted(part, _ACTIVE_LIFT) for part in parts]
            pairs = [np.stack([part[:-1], part[1:]], axis=1) for part in drawn]
            self._active_line = self._scene.add_line_segments(
                f"{self.object_view.path}/active", np.concatenate(pairs) * self._factor, _ACTIVE,
                thickness=5.0, thickness_units="screen",
            )  # fmt: skip

    def set_visible(self, visible: bool) -> None:
        """Show or hide all but the object."""
        self._root.visible = self._marks.visible = visible
        if self._active_line is not None:
            self._active_line.visible = visible

    def remove(self) -> None:
        """Remove the arm, and place the object as it is without one."""
        self._root.remove()
        if not self.object_view.removed:  # else all that is drawn of it is gone already
            self.object_view.place(self._origin + self._object)
            self._marks.remove()
            if self._active_line is not None:
                self._active_line.remove()

    def _body(self, number: int) -> str:
        name = f"/arm/body{number}"
        if number not in self._bodies:
            self._bodies[number] = self._scene.add_frame(name, show_axes=False)
        return name
