"""The objects in the browser: side by side on one floor, seen by one camera."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import viser

from nrdf.geometry.frames import unit_vectors
from nrdf.studio.model.paintable_cloud import PaintableCloud
from nrdf.studio.scene.object_view import ObjectView

FOV_RAD = np.radians(48.0)
_FRONT = np.array([0.86, 0.52, 0.34])
"""Direction from the objects to the camera: front, above, right."""
_RIGHT = np.array([0.42, 0.36, 0.83])
"""The same where an arm stands in front of the object."""
_MARGIN = 1.06  # of the camera's distance, in distances at which everything is just seen
_WHOLE = (0.0, 0.0, 1.0, 1.0)
_GAP = 0.25  # between objects, in sides of the largest


class SceneView:
    """All objects. units_per_m: scene units a metre, such that the reference is about 1 long."""

    def __init__(self, server: viser.ViserServer) -> None:
        self.server = server
        self.objects: dict[str, ObjectView] = {}
        self.units_per_m = 1.0
        self._made = 0
        server.scene.set_up_direction("+y")
        server.initial_camera.fov = FOV_RAD

    def clear(self, units_per_m: float) -> None:
        """Remove every object, and set the scale."""
        for object_view in self.objects.values():
            object_view.remove()
        self.objects.clear()
        self.units_per_m = units_per_m

    def add(
        self, key: str, paintable: PaintableCloud, upright: np.ndarray | None = None
    ) -> ObjectView:
        """Add an object. upright: (3, 3) from its axes to those in which it stands, its own."""
        self._made += 1
        own = np.eye(3) if upright is None else upright
        object_view = ObjectView(self.server, self.units_per_m, key, self._made, paintable, own)
        self.objects[key] = object_view
        return object_view

    def remove(self, key: str) -> None:
        """Remove an object."""
        self.objects.pop(key).remove()

    def arrange(self, shown: Sequence[str]) -> None:
        """Place the objects `shown` in a row, to the right of each other as seen from the front,
        and hide the others."""
        paintables = [object_view.paintable for object_view in self.objects.values()]
        if not paintables:
            return
        gap = _GAP * max(float((b.high - b.low).max()) for b in paintables) * self.units_per_m
        right = 0.0
        for key, object_view in self.objects.items():
            object_view.frame.visible = key in shown
            if key not in shown:
                continue
            low, high = object_view.low * self.units_per_m, object_view.high * self.units_per_m
            # +Z is the object's right-hand side: on the left when seen from the front.
            object_view.place(np.array([-(low[0] + high[0]) / 2, -low[1], right - high[2]]))
            right -= high[2] - low[2] + gap

    def camera(
        self, shown: Sequence[str], aspect: float, arm_points: np.ndarray | None = None,
        free: tuple[float, float, float, float] = _WHOLE,
    ) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
        """Position (3,) and target (3,) of a camera that sees the objects `shown` from the front.

        aspect: width over height. With points (k, 3) of an arm it sees them, too, from the right.
        free: left, top, right and bottom of the part of the window that nothing covers, in shares.
        """
        object_views = [object_view for key, object_view in self.objects.items() if key in shown]
        more = np.zeros((0, 3)) if arm_points is None else arm_points
        corners = np.concatenate([more, *(object_view.corners for object_view in object_views)])
        if not len(corners):
            corners = np.array([[-0.5, 0.0, -0.5], [0.5, 1.0, 0.5]])
        middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
        toward = unit_vectors(_FRONT if arm_points is None else _RIGHT)
        right = unit_vectors(np.cross([0.0, 1.0, 0.0], toward))
        axes = np.stack([right, np.cross(toward, right), toward])
        seen = (corners - middle) @ axes.T
        half = np.tan(FOV_RAD / 2) * np.array([aspect, 1.0])
        left, top, right_end, bottom = free
        low = half * [2 * left - 1, 1 - 2 * bottom]
        high = half * [2 * right_end - 1, 1 - 2 * top]
        # A camera `away` from the middle and `aside` of it sees a point within low and high where
        # aside >= across + depth * high - away * high, and <= the same with low.
        least = (seen[:, :2] + seen[:, 2:] * high).max(axis=0)
        most = (seen[:, :2] + seen[:, 2:] * low).min(axis=0)
        away = _MARGIN * float(((least - most) / (high - low)).max())
        aside = ((least - away * high) + (most - away * low)) / 2
        look_at = middle + aside @ axes[:2]
        return look_at + away * toward, look_at

    def hit(self, origin: np.ndarray, direction: np.ndarray) -> tuple[ObjectView, int] | None:
        """The object and its shown point that a ray meets first."""
        met = [
            (found[1], object_view, found[0])
            for object_view in self.objects.values()
            if object_view.frame.visible
            and (found := object_view.hit(origin, direction)) is not None
        ]
        if not met:
            return None
        _, object_view, index = min(met, key=lambda entry: entry[0])
        return object_view, index
