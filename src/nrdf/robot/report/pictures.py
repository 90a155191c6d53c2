"""Pictures and a short film of the arm at work, drawn by MuJoCo."""

from __future__ import annotations

import io
import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from nrdf.geometry.frames import quaternions_wxyz
from nrdf.geometry.simplify import simplified
from nrdf.io.atomic import write_atomically
from nrdf.robot.model.mujoco_model import mujoco
from nrdf.robot.simulation.execute import ExecutionLog
from nrdf.robot.simulation.scene import cell_specification
from nrdf.robot.simulation.simulate import SimulatedPath, SimulationResult
from nrdf.surface.fine_mesh import refine
from nrdf.surface.target_mesh import TargetMesh
from nrdf.viz.palette import (
    COVERED,
    LEFT_OUT,
    NO_REGION,
    NOT_COVERED,
    NOT_REACHED,
    REACHED,
    region_colours,
)

log = logging.getLogger(__name__)

FILM, STILL, COVERAGE = "film.webp", "picture.png", "coverage.png"
_SIZE, _FILM_SIZE = (1080, 810), (520, 400)
_FRAMES, _FRAME_MS = 90, 120
_MOST_FACES = 60_000  # of a part that is drawn
_LIFT_M = 0.0005  # of regions above the object


def draw_pictures(
    folder: Path,
    result: SimulationResult,
    film: bool = True,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> str | None:
    """Write the pictures and the film; why there are none, where this machine cannot draw."""
    try:
        renderer = _CellRenderer(result, "regions")
    except Exception as error:  # whatever OpenGL raises
        return f"no pictures: this machine has no OpenGL that MuJoCo can draw with ({error})"
    with renderer:
        first = max(
            result.paths, key=lambda simulated: simulated.path.tool_radius_m * _longest(simulated)
        )
        _save(
            folder / STILL,
            renderer.image(first, item := _busiest(first.logs), len(item.joints) // 2, *_SIZE),
        )
        if film:
            _film(folder / FILM, renderer, result, progress)
    with _CellRenderer(result, "coverage") as renderer:
        images = [renderer.object_image(angle, 720, 640) for angle in (-0.6, 2.4)]
        _save(folder / COVERAGE, np.concatenate(images, axis=1))
    return None


def _longest(simulated: SimulatedPath) -> int:
    return max(
        (len(log.joints) for log in simulated.logs if log.action.kind == "process"), default=0
    )


def _busiest(logs: Sequence[ExecutionLog]) -> ExecutionLog:
    return max(
        (item for item in logs if item.action.kind == "process"), key=lambda item: len(item.joints)
    )


def _save(path: Path, image: np.ndarray) -> None:
    from PIL import Image

    drawn = io.BytesIO()
    Image.fromarray(image).save(drawn, "png")
    write_atomically(path, [drawn.getbuffer()])


def _film(
    path: Path,
    renderer: _CellRenderer,
    result: SimulationResult,
    progress: Callable[[int, int], None],
) -> None:
    """Evenly through the whole time, faster than it was."""
    from PIL import Image

    every = [(simulated, item) for simulated in result.paths for item in simulated.logs]
    ends = np.cumsum([len(item.joints) for _, item in every])
    images = []
    for k, step in enumerate(np.linspace(0, ends[-1] - 1, _FRAMES).astype(int)):
        which = int(np.searchsorted(ends, step, side="right"))
        simulated, item = every[which]
        at = int(step - (ends[which] - len(item.joints)))
        images.append(Image.fromarray(renderer.image(simulated, item, at, *_FILM_SIZE)))
        progress(k + 1, _FRAMES)
    film = io.BytesIO()
    images[0].save(
        film, "webp", save_all=True, append_images=images[1:], duration=_FRAME_MS, loop=0,
        quality=60,
    )  # fmt: skip
    write_atomically(path, [film.getbuffer()])


@dataclass(frozen=True)
class _Drawn:
    model: Any
    data: Any
    joints: np.ndarray
    object_id: int


class _CellRenderer:
    """The cell with the object's mesh in the colours of its regions, or of what was covered."""

    def __init__(self, result: SimulationResult, colours: str) -> None:
        self.result = result
        self._parts = _parts(result, colours)
        self._drawn: dict[str, _Drawn] = {}
        self._renderers: dict[tuple[str, int, int], Any] = {}
        # Fails here, where it can be caught, if there is nothing to draw with.
        self._renderer(result.paths[0], 64, 64)

    def __enter__(self) -> _CellRenderer:
        return self

    def __exit__(self, *_: object) -> None:
        for renderer in self._renderers.values():
            renderer.close()

    def image(
        self, simulated: SimulatedPath, item: ExecutionLog, at: int, width: int, height: int
    ) -> np.ndarray:
        """The cell (h, w, 3) at one step of an action, with the tool path on the object."""
        drawn = self._model(simulated)
        pose = simulated.cell.T_base_object[item.action.turntable_index]
        self._place(drawn, item.joints[at], pose)
        renderer = self._renderer(simulated, width, height)
        camera = mujoco.MjvCamera()
        middle = 0.6 * (pose[:3, :3] @ self._middle() + pose[:3, 3])
        camera.lookat[:] = middle + np.array([0.0, 0.0, 0.1])
        camera.distance, camera.azimuth, camera.elevation = 2.3, 118.0, -16.0
        renderer.update_scene(drawn.data, camera)
        # Shadows cost half of the time, and a small picture does well without.
        shadows = width > _FILM_SIZE[0]
        renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = shadows
        _add_lines(renderer.scene, simulated, pose)
        return np.asarray(renderer.render())

    def object_image(self, angle: float, width: int, height: int) -> np.ndarray:
        """The object alone (h, w, 3), from an angle about its upright axis."""
        simulated = self.result.paths[0]
        drawn = self._model(simulated)
        pose = simulated.cell.T_base_object[0]
        self._place(drawn, simulated.logs[0].joints[0], pose)
        renderer = self._renderer(simulated, width, height)
        camera = mujoco.MjvCamera()
        camera.lookat[:] = pose[:3, :3] @ self._middle() + pose[:3, 3]
        size = float(np.linalg.norm(np.subtract(*self.result.distance_field.box)))
        camera.distance, camera.elevation = 1.15 * size + 0.2, -20.0
        camera.azimuth = np.degrees(angle)
        option = mujoco.MjvOption()
        option.geomgroup[:] = 0
        option.geomgroup[2] = 1
        renderer.update_scene(drawn.data, camera, option)
        return np.asarray(renderer.render())

    def _middle(self) -> np.ndarray:
        low, high = self.result.distance_field.box
        return np.asarray(0.5 * (low + high))

    def _place(self, drawn: _Drawn, joints: np.ndarray, pose: np.ndarray) -> None:
        drawn.data.qpos[drawn.joints] = joints
        drawn.data.mocap_pos[drawn.object_id] = pose[:3, 3]
        drawn.data.mocap_quat[drawn.object_id] = quaternions_wxyz(pose[:3, :3])
        mujoco.mj_forward(drawn.model, drawn.data)

    def _model(self, simulated: SimulatedPath) -> _Drawn:
        key = f"{simulated.path.tool} {simulated.path.tool_radius_m}"
        if key not in self._drawn:
            self._drawn[key] = _build(simulated, self._parts)
        return self._drawn[key]

    def _renderer(self, simulated: SimulatedPath, width: int, height: int) -> Any:
        key = (f"{simulated.path.tool} {simulated.path.tool_radius_m}", width, height)
        if key not in self._renderers:
            model = self._model(simulated).model
            self._renderers[key] = mujoco.Renderer(model, height, width, max_geom=4000)
        return self._renderers[key]


def _build(
    simulated: SimulatedPath, parts: list[tuple[np.ndarray, np.ndarray, tuple[float, ...]]]
) -> _Drawn:
    cell = simulated.cell
    spec = cell_specification(cell)
    spec.visual.global_.offwidth, spec.visual.global_.offheight = 1440, 1080
    spec.visual.headlight.ambient[:] = 0.42
    spec.visual.headlight.diffuse[:] = 0.42
    spec.visual.map.znear = 0.005
    sky = spec.add_texture(name="nrdf_sky", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX)
    sky.builtin = mujoco.mjtBuiltin.mjBUILTIN_GRADIENT
    sky.rgb1[:], sky.rgb2[:] = (0.97, 0.98, 1.0), (0.86, 0.89, 0.93)
    sky.width = sky.height = 64
    world = spec.worldbody
    world.add_light(pos=[-0.6, -1.2, 2.6], dir=[0.3, 0.5, -1.0], diffuse=[0.5, 0.5, 0.5])
    world.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE, size=[3.0, 3.0, 0.1], pos=[0.6, 0.0, cell.floor_m],
        rgba=[0.90, 0.91, 0.93, 1.0],
    )  # fmt: skip
    if cell.floor_m < -0.02:
        world.add_geom(
            type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=[0.09, 0.0, 0.0],
            fromto=[0.0, 0.0, cell.floor_m, 0.0, 0.0, 0.0], rgba=[0.45, 0.47, 0.5, 1.0],
        )  # fmt: skip
    for box in cell.keep_out:
        world.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX, size=box.half_m, pos=box.T_base_box[:3, 3],
            quat=quaternions_wxyz(box.T_base_box[:3, :3]), rgba=[0.85, 0.45, 0.25, 0.35],
        )  # fmt: skip
    body = world.add_body(name="nrdf_object", mocap=True)
    for number, (vertices, faces, colour) in enumerate(parts):
        name = f"nrdf_part_{number}"
        mesh = spec.add_mesh(name=name)
        mesh.uservert, mesh.userface = vertices.ravel().tolist(), faces.ravel().tolist()
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, rgba=[*colour, 1.0], group=2,
            contype=0, conaffinity=0,
        )  # fmt: skip
    model = spec.compile()
    joints = model.jnt_qposadr[[model.joint(name).id for name in cell.arm.joint_names]]
    mocap = int(model.body_mocapid[model.body("nrdf_object").id])
    return _Drawn(model, mujoco.MjData(model), joints, mocap)


def _parts(
    result: SimulationResult, colours: str
) -> list[tuple[np.ndarray, np.ndarray, tuple[float, ...]]]:
    """The object's mesh, and above it its regions by colour: vertices, faces and colour of each."""
    surfaces = result.simulation_job.surfaces
    made: list[tuple[np.ndarray, np.ndarray, tuple[float, ...]]] = []

    def add(mesh: TargetMesh, faces: np.ndarray, colour: tuple[float, ...], lift: float) -> None:
        if len(faces) >= 4:
            used, index = np.unique(faces, return_inverse=True)
            lifted = mesh.vertices[used] + lift * mesh.vertex_normals[used]
            made.append((*simplified(lifted, index.reshape(-1, 3), _MOST_FACES), colour))

    add(surfaces.given, surfaces.given.faces, NO_REGION, 0.0)
    if colours == "regions":
        inks = region_colours(list(surfaces.regions))
        for name, region in surfaces.regions.items():
            add(region.mesh, region.mesh.faces, tuple(0.55 * inks[name] + 0.45), _LIFT_M)
        return made
    for simulated in result.paths:
        metrics, region = simulated.metrics, surfaces.regions[simulated.path.region]
        fine = refine(region.mesh.vertices, region.mesh.faces, simulated.path.tool_radius_m / 3)
        mesh = TargetMesh(fine.vertices, fine.faces)
        middles = mesh.vertices[mesh.faces].mean(axis=1)
        samples = metrics.samples
        # On a thin part the nearest sample may be of the other side.
        near = _nearest_alike(samples.points, samples.normals, middles, mesh.face_normals)
        label = np.where(metrics.worked, 0, np.where(samples.wanted, 1, 2))[near]
        for number, colour in enumerate((COVERED, NOT_COVERED, LEFT_OUT)):
            add(mesh, mesh.faces[label == number], colour, _LIFT_M)
    return made


def _nearest_alike(
    points: np.ndarray, normals: np.ndarray, places: np.ndarray, facing: np.ndarray
) -> np.ndarray:
    """Index (m,) of the nearest of points (k, 3) that look the way places (m, 3) do."""
    distance, near = cKDTree(points).query(places, min(6, len(points)))
    away = distance + 0.02 * (1.0 - np.einsum("fka,fa->fk", normals[near], facing))
    return np.asarray(near[np.arange(len(near)), away.argmin(axis=1)])


def _add_lines(scene: Any, simulated: SimulatedPath, pose: np.ndarray) -> None:
    """The path's lines, dark where they are simulated, red where not."""
    for group, verdict in zip(simulated.path.groups, simulated.metrics.verdicts, strict=True):
        height = simulated.strategy.standoff_m
        points = group.process.positions + (height - 0.002) * group.process.axes
        points = points @ pose[:3, :3].T + pose[:3, 3]
        for k in range(len(points) - 1):
            if scene.ngeom >= scene.maxgeom:
                return
            good = verdict[k] == "reached" and verdict[k + 1] == "reached"
            colour = (*(REACHED if good else NOT_REACHED), 1.0)
            geom = scene.geoms[scene.ngeom]
            mujoco.mjv_initGeom(
                geom, mujoco.mjtGeom.mjGEOM_CAPSULE, np.zeros(3), np.zeros(3),
                np.zeros(9), np.array(colour, np.float32),
            )  # fmt: skip
            mujoco.mjv_connector(
                geom, mujoco.mjtGeom.mjGEOM_CAPSULE, 0.0016, points[k], points[k + 1]
            )
            scene.ngeom += 1
