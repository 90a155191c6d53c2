"""One object in the browser: its pose, its surface, its regions, its lines, and rays to it."""

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

_ABOVE = 0.14  # of the label above the object, in the scene
_SIZE = 1.38  # of a point, in spacings
_LIFT = 1.4  # of lines above points, in spacings
_ON_MESH = 0.0015  # of lines above a mesh, in sides of the object; regions lie half as high
_LIGHT = np.array([0.62, 0.70, 0.35])
"""Direction to the light: front, above, right."""
_UNCOVERED = 0.8  # spacings from its surface from which a scan's point has none
_REMOVED = (226, 140, 130)  # colour of points that cleaning removed
_DARKEST = 0.58  # brightness of a point that faces away from the light


class ObjectView:
    """One object in the scene: its pose, and what is drawn of it. units_per_m: of the scene."""

    def __init__(
        self, server: viser.ViserServer, units_per_m: float, key: str, number: int,
        paintable: PaintableCloud, upright: np.ndarray,
    ) -> None:  # fmt: skip
        self.key, self.paintable = key, paintable
        self.server, self.units_per_m = server, units_per_m
        self.path = f"/object{number}"
        self.offset, self._rotation, self.upright = np.zeros(3), upright, upright
        stands = paintable.points @ upright.T
        self.low, self.high = stands.min(axis=0), stands.max(axis=0)
        """Lowest and highest corner (3,) of the object as it stands, m."""
        self.removed = False
        scene = server.scene
        self.frame = scene.add_frame(self.path, show_axes=False)
        self.points = scene.add_point_cloud(
            f"{self.path}/points",
            (paintable.points * units_per_m).astype(np.float32),
            np.full((len(paintable.points), 3), 200, np.uint8),
            point_size=_SIZE * paintable.surface.spacing * units_per_m,
            point_shape="circle",
            point_shading="flat",
            precision="float32",
        )
        self._regions: list[viser.SceneNodeHandle] = []
        self._removed: viser.SceneNodeHandle | None = None
        self._mesh: viser.SceneNodeHandle | None = None
        self._drawn: Triangles | None = None
        self._bare = np.zeros(len(paintable.points), bool)
        self._drawn_regions: list[tuple[str, int, bytes]] = []
        self._held: list[Triangles] = []
        self.draw_surface(None)
        size = (paintable.high - paintable.low) * units_per_m
        # Invisible: drags that paint must begin on something. Only lines, for slow renderers.
        self.drag_box = scene.add_box(
            f"{self.path}/drag_box",
            dimensions=tuple(1.02 * size),
            position=tuple((paintable.low + paintable.high) / 2 * units_per_m),
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
            position=tuple(self.top * units_per_m + upright.T @ [0.0, _ABOVE, 0.0]),
            anchor="bottom-center",
        )
        self._draw_axes()
        self._lines: list[viser.SceneNodeHandle] = []
        self._arrows: dict[str, viser.SceneNodeHandle] = {}

    @property
    def corners(self) -> np.ndarray:
        """Corners (8, 3) of the object's bounding box in the scene, with the label above it."""
        scale = self.units_per_m
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

        Above a mesh only points that have a colour of their own are drawn, and those that a mesh
        made of a scan has no surface at.
        """
        light = self.upright.T @ (_LIGHT / np.linalg.norm(_LIGHT))
        facing = 0.5 + 0.5 * self.paintable.normals @ light
        shade = _DARKEST + (1 - _DARKEST) * facing
        shaded = (colours * shade[:, None]).astype(np.uint8)
        if self._mesh is not None:
            own = (colours != BARE.astype(np.uint8)).any(axis=1) | self._bare
            self.points.visible = bool(own.any())  # a browser takes no empty cloud
            if not own.any():
                return
            points = self.paintable.points[own] * self.units_per_m
            self.points.points, shaded = points.astype(np.float32), shaded[own]
        self.points.colors = shaded

    def draw_surface(self, mesh: Triangles | None) -> None:
        """Draw an object's own mesh, or, where it has none, this one, m; None for no mesh."""
        given = self.paintable.mesh or mesh
        if given is self._drawn and (given is None) == (self._mesh is None):
            return
        self._drawn, shown = given, None
        if given is not None:
            shown = Mesh(*simplified(given.vertices, given.faces, SHOWN_FACES))
        if self._mesh is not None:
            self._mesh.remove()
        self._mesh = None if shown is None else self._add_mesh("mesh", shown, BARE)
        self._bare = np.zeros(len(self.paintable.points), bool)
        if shown is not None and self.paintable.mesh is None:
            far = _UNCOVERED * self.paintable.surface.spacing
            faces = np.asarray(shown.faces, np.int64)
            away = igl.point_mesh_squared_distance(self.paintable.points, shown.vertices, faces)[0]
            self._bare = np.asarray(away) > far**2

    def draw_removed(self, points: np.ndarray) -> None:
        """Draw points (k, 3), m, that cleaning removed, in place of earlier ones."""
        if self._removed is not None:
            self._removed.remove()
        factor, self._removed = self.units_per_m, None
        if len(points):
            self._removed = self.server.scene.add_point_cloud(
                f"{self.path}/removed",
                (points * factor).astype(np.float32),
                np.full((len(points), 3), _REMOVED, np.uint8),
                point_size=0.6 * _SIZE * self.paintable.surface.spacing * factor,
                point_shape="circle",
            )

    def draw_regions(self, regions: Mapping[str, tuple[Triangles, np.ndarray]]) -> None:
        """Draw the meshes of regions by name, m, in place of all earlier ones, each with a colour
        (3,), 0 to 255."""
        now = [(name, id(mesh), colour.tobytes()) for name, (mesh, colour) in regions.items()]
        if now == self._drawn_regions:
            return
        for handle in self._regions:
            handle.remove()
        self._regions.clear()
        self._drawn_regions = now
        self._held = [mesh for mesh, _ in regions.values()]  # so that no other has its id
        lift = 0.5 * _ON_MESH * self.paintable.longest_side
        for number, (mesh, colour) in enumerate(regions.values()):
            vertices, faces = simplified(mesh.vertices, mesh.faces, SHOWN_FACES)
            normals = np.asarray(igl.per_vertex_normals(vertices, faces))
            lifted = vertices + lift * unit_vectors(np.nan_to_num(normals))
            self._regions.append(self._add_mesh(f"region{number}", Mesh(lifted, faces), colour))

    def _add_mesh(self, name: str, mesh: Mesh, colour: np.ndarray) -> viser.SceneNodeHandle:
        vertices, faces = split_at_edges(mesh.vertices, mesh.faces)
        red, green, blue = (int(value) for value in colour)
        return self.server.scene.add_mesh_simple(
            f"{self.path}/{name}",
            (vertices * self.units_per_m).astype(np.float32),
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

    def _draw_axes(self) -> None:
        """Draw the object's own axes (x red, y green, z blue) before its lowest front corner, and
        along z how long some round number of millimetres is."""
        scene, factor = self.server.scene, self.units_per_m
        low, high = self.paintable.low, self.paintable.high
        corner = np.array([high[0], low[1], low[2]]) * factor + [0.06, 0.0, 0.0]
        long_m = 10.0 ** np.floor(np.log10(0.5 * max(self.paintable.longest_side, 1e-6)))
        long = long_m * factor
        scene.add_frame(
            f"{self.path}/axes", position=tuple(corner), axes_length=0.5 * long,
            axes_radius=0.006, origin_radius=0.008,
        )  # fmt: skip
        bar = np.array([[[0, 0, 0], [0, 0, long]], [[0, 0, long], [0, 0.06 * long, long]]])
        scene.add_line_segments(
            f"{self.path}/scale", bar + corner, (90, 96, 102), thickness=3.0,
            thickness_units="screen",
        )  # fmt: skip
        scene.add_label(
            f"{self.path}/scale/words", f"{1e3 * long_m:g} mm",
            position=tuple(corner + np.array([0.0, -0.03, long])),
        )  # fmt: skip

    def set_label(self, text: str) -> None:
        """Set the text above the object."""
        self.label.text = text

    def draw_lines(self, lines: Mapping[str, tuple[Sequence[np.ndarray], np.ndarray]]) -> None:
        """Draw lines by name in place of all earlier ones, each (arrays (m, 3), m; colour (3,))."""
        scene, factor = self.server.scene, self.units_per_m
        for handle in self._lines:
            handle.remove()
        self._lines.clear()
        for number, (parts, colour) in enumerate(lines.values()):
            drawn = [self.lifted(part) for part in parts if len(part) > 1]
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
        factor = self.units_per_m
        lift = 2 * self.paintable.surface.spacing
        ends = np.array([[start, stop]])
        near = int(np.argmin(np.linalg.norm(self.paintable.points - start, axis=1)))
        self._arrows[name] = self.server.scene.add_arrows(
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
            (origin - self.offset) @ self._rotation / self.units_per_m,
            direction @ self._rotation,
            self.paintable.surface.spacing,
        )
        return None if found is None else (found[0], found[1] * self.units_per_m)

    def camera(self, camera: Camera) -> Camera:
        """A camera of the scene as the object sees it, m."""
        position = (camera.position - self.offset) @ self._rotation / self.units_per_m
        return Camera(position, self._rotation.T @ camera.rotation, camera.fov_rad, camera.aspect)

    def remove(self) -> None:
        """Remove the object and all that is drawn of it."""
        self.removed = True
        self.frame.remove()

    def lifted(self, line: np.ndarray, times: float = 1.0) -> np.ndarray:
        """A line (m, 3), m, on the surface as it is drawn above it, or some `times` as high."""
        surface = self.paintable.surface
        lift = _LIFT * surface.spacing
        if self._mesh is not None:
            lift = _ON_MESH * self.paintable.longest_side
        return line + times * lift * surface.normals[surface.tree.query(line)[1]]
