"""The objects in the browser: side by side on one floor, seen by one camera."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import product
from typing import Any

import igl
import numpy as np
import viser

from nrdf.geometry.frames import quaternions_wxyz, unit_vectors
from nrdf.geometry.mesh import Mesh
from nrdf.geometry.simplify import simplified, split_at_edges
from nrdf.studio.model.paintable_cloud import SHOWN_FACES, PaintableCloud
from nrdf.studio.scene.camera import Camera, first_hit
from nrdf.studio.scene.colours import BARE
from nrdf.viz.mesh_render import Triangles

FOV_RAD = np.radians(48.0)
_FRONT = np.array([0.86, 0.52, 0.34])
"""Direction from the objects to the camera: front, above, right."""
_RIGHT = np.array([0.42, 0.36, 0.83])
"""The same where an arm stands in front of the object."""
_MARGIN = 1.06  # of the camera's distance, in distances at which everything is just seen
_ABOVE = 0.14  # of the label above the object, in the scene
_GAP = 0.25  # between objects, in sides of the largest
_SIZE = 1.38  # of a point, in spacings
_LIFT = 1.4  # of lines above points, in spacings
_ON_MESH = 0.0015  # of lines above a mesh, in sides of the object; regions lie half as high
_LIGHT = np.array([0.62, 0.70, 0.35])
"""Direction to the light: front, above, right."""
_REMOVED = (226, 140, 130)  # colour of points that cleaning removed
_DARKEST = 0.58  # brightness of a point that faces away from the light


class ObjectView:
    """One object in the scene: its pose, and what is drawn of it."""

    def __init__(
        self, scene_view: SceneView, key: str, number: int, paintable: PaintableCloud,
        upright: np.ndarray,
    ) -> None:  # fmt: skip
        self.key, self.paintable, self.scene_view = key, paintable, scene_view
        self.path = f"/object{number}"
        self.offset, self._rotation, self.upright = np.zeros(3), upright, upright
        stands = paintable.points @ upright.T
        self.low, self.high = stands.min(axis=0), stands.max(axis=0)
        """Lowest and highest corner (3,) of the object as it stands, m."""
        self.removed = False
        scene = scene_view.server.scene
        self.frame = scene.add_frame(self.path, show_axes=False)
        self.points = scene.add_point_cloud(
            f"{self.path}/points",
            (paintable.points * scene_view.units_per_m).astype(np.float32),
            np.full((len(paintable.points), 3), 200, np.uint8),
            point_size=_SIZE * paintable.surface.spacing * scene_view.units_per_m,
            point_shape="circle",
            point_shading="flat",
            precision="float32",
        )
        self._regions: list[viser.SceneNodeHandle] = []
        self._removed: viser.SceneNodeHandle | None = None
        self._mesh: viser.SceneNodeHandle | None = None
        self.draw_surface(None)
        size = (paintable.high - paintable.low) * scene_view.units_per_m
        # Invisible: drags that paint must begin on something. Only lines, for slow renderers.
        self.drag_box = scene.add_box(
            f"{self.path}/drag_box",
            dimensions=tuple(1.02 * size),
            position=tuple((paintable.low + paintable.high) / 2 * scene_view.units_per_m),
            wireframe=True,
            flat_shading=False,
            opacity=0.0,
            cast_shadow=False,
            receive_shadow=False,
            visible=False,
        )
        self.label = scene.add_label(
            f"{self.path}/label",
            key,
            position=tuple(self.top * scene_view.units_per_m + upright.T @ [0.0, _ABOVE, 0.0]),
            anchor="bottom-center",
        )
        self._lines: list[viser.SceneNodeHandle] = []
        self._arrows: dict[str, viser.SceneNodeHandle] = {}

    @property
    def corners(self) -> np.ndarray:
        """Corners (8, 3) of the object's bounding box in the scene, with the label above it."""
        scale = self.scene_view.units_per_m
        low, high = self.low * scale, self.high * scale
        high[1] += _ABOVE
        choice = np.array(list(product((False, True), repeat=3)))
        stands = np.where(choice, high, low) @ self.upright
        return stands @ self._rotation.T + self.offset

    @property
    def top(self) -> np.ndarray:
        """The point (3,) above the middle of the object, at its full height, m."""
        middle = (self.low + self.high) / 2
        return np.asarray(self.upright.T @ [middle[0], self.high[1], middle[2]])

    @property
    def front(self) -> tuple[np.ndarray, np.ndarray]:
        """Ends (3,) of an arrow on the floor, from under the object out of its front, m."""
        start = np.array([self.high[0], self.low[1], (self.low[2] + self.high[2]) / 2])
        out = np.array([0.3 * self.paintable.longest_side, 0.0, 0.0])
        return self.upright.T @ start, self.upright.T @ (start + out)

    def place(self, offset: np.ndarray, rotation: np.ndarray | None = None) -> None:
        """Move the object: offset (3,) in the scene; rotation (3, 3), or `upright`."""
        self.offset, self._rotation = offset, self.upright if rotation is None else rotation
        self.frame.position = tuple(offset)
        self.frame.wxyz = tuple(quaternions_wxyz(self._rotation))

    def set_colours(self, colours: np.ndarray) -> None:
        """Set the colours (k, 3) uint8 of the shown points; shading is added here.

        Above a mesh only points that have a colour of their own are drawn.
        """
        light = self.upright.T @ (_LIGHT / np.linalg.norm(_LIGHT))
        facing = 0.5 + 0.5 * self.paintable.normals @ light
        shade = _DARKEST + (1 - _DARKEST) * facing
        shaded = (colours * shade[:, None]).astype(np.uint8)
        if self._mesh is not None:
            own = (colours != BARE.astype(np.uint8)).any(axis=1)
            self.points.visible = bool(own.any())  # a browser takes no empty cloud
            if not own.any():
                return
            points = self.paintable.points[own] * self.scene_view.units_per_m
            self.points.points, shaded = points.astype(np.float32), shaded[own]
        self.points.colors = shaded

    def draw_surface(self, mesh: Triangles | None) -> None:
        """Draw an object's own mesh, or, where it has none, this one, m; None for no mesh."""
        shown = self.paintable.mesh
        if shown is None and mesh is not None:
            shown = Mesh(*simplified(mesh.vertices, mesh.faces, SHOWN_FACES))
        elif shown is not None and self._mesh is not None:
            return
        if self._mesh is not None:
            self._mesh.remove()
        self._mesh = None if shown is None else self._add_mesh("mesh", shown, BARE)

    def draw_removed(self, points: np.ndarray) -> None:
        """Draw points (k, 3), m, that cleaning removed, in place of earlier ones."""
        if self._removed is not None:
            self._removed.remove()
        factor, self._removed = self.scene_view.units_per_m, None
        if len(points):
            self._removed = self.scene_view.server.scene.add_point_cloud(
                f"{self.path}/removed",
                (points * factor).astype(np.float32),
                np.full((len(points), 3), _REMOVED, np.uint8),
                point_size=0.6 * _SIZE * self.paintable.surface.spacing * factor,
                point_shape="circle",
            )

    def draw_regions(self, regions: Mapping[str, tuple[Triangles, np.ndarray]]) -> None:
        """Draw the meshes of regions by name, m, in place of all earlier ones, each with a colour
        (3,), 0 to 255."""
        for handle in self._regions:
            handle.remove()
        self._regions.clear()
        lift = 0.5 * _ON_MESH * self.paintable.longest_side
        for number, (mesh, colour) in enumerate(regions.values()):
            vertices, faces = simplified(mesh.vertices, mesh.faces, SHOWN_FACES)
            normals = np.asarray(igl.per_vertex_normals(vertices, faces))
            lifted = vertices + lift * unit_vectors(np.nan_to_num(normals))
            self._regions.append(self._add_mesh(f"region{number}", Mesh(lifted, faces), colour))

    def _add_mesh(self, name: str, mesh: Mesh, colour: np.ndarray) -> viser.SceneNodeHandle:
        vertices, faces = split_at_edges(mesh.vertices, mesh.faces)
        red, green, blue = (int(value) for value in colour)
        return self.scene_view.server.scene.add_mesh_simple(
            f"{self.path}/{name}",
            (vertices * self.scene_view.units_per_m).astype(np.float32),
            faces.astype(np.uint32),
            color=(red, green, blue),
            side="double",
            cast_shadow=False,
            receive_shadow=False,
        )

    def set_drag_callback(self, callback: Callable[..., Any] | None) -> None:
        """Call this for drags that begin on the object; None gives them to the camera."""
        if (callback is not None) == self.drag_box.visible:
            return
        self.drag_box.visible = callback is not None
        if callback is None:
            self.drag_box.remove_drag_callback()
        else:
            self.drag_box.on_drag(callback)

    def set_label(self, text: str) -> None:
        """Set the text above the object."""
        self.label.text = text

    def draw_lines(self, lines: Mapping[str, tuple[Sequence[np.ndarray], np.ndarray]]) -> None:
        """Draw lines by name in place of all earlier ones, each (arrays (m, 3), m; colour (3,))."""
        scene, factor = self.scene_view.server.scene, self.scene_view.units_per_m
        for handle in self._lines:
            handle.remove()
        self._lines.clear()
        for number, (parts, colour) in enumerate(lines.values()):
            drawn = [self._lifted(part) for part in parts if len(part) > 1]
            if not drawn:
                continue
            pairs = [np.stack([part[:-1], part[1:]], axis=1) for part in drawn]
            handle = scene.add_line_segments(
                f"{self.path}/line{number}",
                np.concatenate(pairs) * factor,
                np.asarray(colour, np.uint8),
                thickness=2.5,
                thickness_units="screen",
            )
            self._lines.append(handle)

    def draw_arrow(self, name: str, start: np.ndarray | None, stop: np.ndarray | None) -> None:
        """Draw an arrow from one point (3,) to another, m, or remove it."""
        if name in self._arrows:
            self._arrows.pop(name).remove()
        if start is None or stop is None or np.linalg.norm(stop - start) < 1e-6:
            return
        factor = self.scene_view.units_per_m
        lift = 2 * self.paintable.surface.spacing
        ends = np.array([[start, stop]])
        near = int(np.argmin(np.linalg.norm(self.paintable.points - start, axis=1)))
        self._arrows[name] = self.scene_view.server.scene.add_arrows(
            f"{self.path}/{name}",
            (ends + lift * self.paintable.normals[near]) * factor,
            (20, 20, 24),
            shaft_radius=0.008,
            head_radius=0.022,
            head_length=0.05,
        )

    def hit(self, origin: np.ndarray, direction: np.ndarray) -> tuple[int, float] | None:
        """The shown point that a ray of the scene meets first, and the depth in the scene."""
        found = first_hit(
            self.paintable.points,
            self.paintable.normals,
            (origin - self.offset) @ self._rotation / self.scene_view.units_per_m,
            direction @ self._rotation,
            self.paintable.surface.spacing,
        )
        return None if found is None else (found[0], found[1] * self.scene_view.units_per_m)

    def camera(self, camera: Camera) -> Camera:
        """A camera of the scene as the object sees it, m."""
        position = (camera.position - self.offset) @ self._rotation / self.scene_view.units_per_m
        return Camera(position, self._rotation.T @ camera.rotation, camera.fov_rad, camera.aspect)

    def remove(self) -> None:
        """Remove the object and all that is drawn of it."""
        self.removed = True
        self.frame.remove()

    def _lifted(self, line: np.ndarray) -> np.ndarray:
        surface = self.paintable.surface
        lift = _LIFT * surface.spacing
        if self._mesh is not None:
            lift = _ON_MESH * self.paintable.longest_side
        return line + lift * surface.normals[surface.tree.query(line)[1]]


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
        object_view = ObjectView(self, key, self._made, paintable, own)
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
        self, shown: Sequence[str], aspect: float, arm_points: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Position (3,) and target (3,) of a camera that sees the objects `shown` from the front.

        aspect: width over height. With points (k, 3) of an arm it sees them, too, from the right.
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
        away = float((np.abs(seen[:, :2]) / half + seen[:, 2:]).max())
        return middle + _MARGIN * away * toward, middle

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
