"""A simulated job as it is played back: shapes, and their poses at every moment."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from nrdf.geometry.frames import quaternions_wxyz
from nrdf.robot.model.cell import COLUMN_RADIUS_M
from nrdf.robot.model.mujoco_model import mujoco
from nrdf.robot.planning.timing import STEP_S
from nrdf.robot.report.content import simulation_report
from nrdf.robot.report.trajectories import written_steps
from nrdf.robot.simulation.scene import cell_specification

if TYPE_CHECKING:
    from nrdf.robot.simulation.simulate import SimulatedPath, SimulationResult
    from nrdf.toolpath.types import Segment

FLOOR = -1  # the body of what does not move
EVERY_PATH = -1
_OF_TOOL = "nrdf_"  # begins the names of what the cell adds to the arm
_SEEN_GROUPS = 3  # MuJoCo's viewers show shapes of the first three
_SECTIONS = 20
_GREY = (120, 124, 130)
_TABLE_M = (0.2, 0.02)  # radius and height of what the object stands on


@dataclass(frozen=True)
class Shape:
    """A mesh on a body: vertices (v, 3), m, in the body's frame (the cell's for `FLOOR`); faces
    (f, 3); colour red, green, blue, 0 to 255; path: the tool path during which it is there, or
    `EVERY_PATH`."""

    body: int
    vertices: np.ndarray
    faces: np.ndarray
    colour: tuple[int, int, int]
    path: int = EVERY_PATH


@dataclass(frozen=True)
class Playback:
    """A job on an arm, in the cell's frame (`nrdf.robot.model.cell.Placement`), about every 40 ms.

    times: (t,), s. At each: path (t,), the number of the tool path; motion (t,), a
    `nrdf.robot.planning.program.ActionKind`; line (t,), -1 between lines; force_n (t,);
    turntable_rad (t,); positions (t, b, 3) and quaternions_wxyz (t, b, 4) of the bodies.
    T_cell_object: (4, 4), of the object at turntable angle 0. unreached: (k, 3), waypoints that are
    not reached, in the object's frame, m; lines: of each tool path its lines by number, as places
    (k, 3) on the surface each, in the same frame. report: the content of report.json.
    """

    shapes: tuple[Shape, ...]
    times: np.ndarray
    path: np.ndarray
    motion: np.ndarray
    line: np.ndarray
    force_n: np.ndarray
    turntable_rad: np.ndarray
    positions: np.ndarray
    quaternions_wxyz: np.ndarray
    T_cell_object: np.ndarray
    unreached: np.ndarray
    lines: tuple[dict[int, list[np.ndarray]], ...]
    report: dict[str, Any]

    @property
    def seconds(self) -> float:
        """How long the job takes."""
        return float(self.times[-1])

    def index_at(self, time_s: float) -> int:
        """The index of a moment."""
        return int(np.clip(np.searchsorted(self.times, time_s), 0, len(self.times) - 1))


def playback_of(simulated: SimulationResult) -> Playback:
    """A simulation as it is played back."""
    shapes: list[Shape] = _standing(simulated)
    parts: dict[str, list[np.ndarray]] = defaultdict(list)
    clock, last_rad = 0.0, None
    for number, path in enumerate(simulated.paths):
        model = cell_specification(path.cell).compile()
        made = _shapes(model, number)
        shapes += [shape for shape in made if number == 0 or shape.path == number]
        mover = _Mover(model, path, simulated.placement.T_cell_base())
        for log in path.logs:
            kept = written_steps(log)
            count = len(kept)
            positions, quaternions = mover(log.joints[kept])
            angle = path.cell.turntable_rad[log.action.turntable_index]
            last_rad = angle if last_rad is None else last_rad
            step = (angle - last_rad + np.pi) % (2 * np.pi) - np.pi
            line = path.line(log)
            added = {
                "times": clock + kept * STEP_S,
                "path": np.full(count, number),
                "motion": np.full(count, log.action.kind),
                "line": np.full(count, line),
                "force_n": log.force_n[kept],
                "turntable_rad": last_rad + step * np.linspace(1 / count, 1, count),
                "positions": positions.astype(np.float32),
                "quaternions_wxyz": quaternions.astype(np.float32),
            }
            for name, values in added.items():
                parts[name].append(values)
            clock += len(log.joints) * STEP_S
            last_rad = angle
    return Playback(
        tuple(shapes),
        **{name: np.concatenate(values) for name, values in parts.items()},
        T_cell_object=_upright(simulated),
        unreached=np.concatenate([_unreached(path) for path in simulated.paths]),
        lines=tuple(_lines(path) for path in simulated.paths),
        report=simulation_report(simulated),
    )


class _Mover:
    """The bodies' poses in the cell's frame at given joints."""

    def __init__(self, model: Any, path: SimulatedPath, T_cell_base: np.ndarray) -> None:
        self._model, self._data = model, mujoco.MjData(model)
        names = path.cell.arm.joint_names
        self._joints = model.jnt_qposadr[[model.joint(name).id for name in names]]
        self._translation = T_cell_base[:3, 3]
        self._rotation = T_cell_base[:3, :3]

    def __call__(self, joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Positions (t, b, 3) and quaternions, scalar first, (t, b, 4) at joints (t, n)."""
        positions = np.zeros((len(joints), self._model.nbody - 1, 3))
        matrices = np.zeros((len(joints), self._model.nbody - 1, 9))
        for k, values in enumerate(joints):
            self._data.qpos[self._joints] = values
            mujoco.mj_kinematics(self._model, self._data)
            positions[k], matrices[k] = self._data.xpos[1:], self._data.xmat[1:]
        turned = self._rotation @ matrices.reshape(-1, 3, 3)
        quaternions = quaternions_wxyz(turned)
        positions = positions @ self._rotation.T + self._translation
        return positions, quaternions.reshape(*positions.shape[:2], 4)


def _shapes(model: Any, path: int) -> list[Shape]:
    """The meshes of an arm with a path's tool; bodies are numbered from 0, the base."""
    groups = model.geom_group < _SEEN_GROUPS
    made = []
    for geom in np.flatnonzero(groups if groups.any() else np.ones(model.ngeom, bool)):
        mesh = _mesh(model, int(geom))
        if mesh is None:
            continue
        rotation = Rotation.from_quat(np.roll(model.geom_quat[geom], -1)).as_matrix()
        vertices = mesh.vertices @ rotation.T + model.geom_pos[geom]
        material = int(model.geom_matid[geom])
        colour = model.geom_rgba[geom] if material < 0 else model.mat_rgba[material]
        tool = model.geom(geom).name.startswith(_OF_TOOL)
        made.append(
            Shape(
                int(model.geom_bodyid[geom]) - 1,
                vertices.astype(np.float32),
                np.asarray(mesh.faces, np.uint32),
                _rgb(colour),
                path if tool else EVERY_PATH,
            )
        )
    return made


def _mesh(model: Any, geom: int) -> trimesh.Trimesh | None:
    """A shape in its own frame; None for one that has no end, such as a plane."""
    kind, size, known = int(model.geom_type[geom]), model.geom_size[geom], mujoco.mjtGeom
    if kind == int(known.mjGEOM_CAPSULE):
        return trimesh.creation.capsule(2 * size[1], size[0], count=(_SECTIONS, 12))
    if kind == int(known.mjGEOM_CYLINDER):
        return trimesh.creation.cylinder(size[0], 2 * size[1], sections=_SECTIONS)
    if kind == int(known.mjGEOM_BOX):
        return trimesh.creation.box(2 * size)
    if kind in (int(known.mjGEOM_SPHERE), int(known.mjGEOM_ELLIPSOID)):
        round_one = trimesh.creation.icosphere(2)
        sides = size if kind == int(known.mjGEOM_ELLIPSOID) else np.repeat(size[0], 3)
        round_one.vertices *= sides
        return round_one
    if kind == int(known.mjGEOM_MESH):
        mesh = model.mesh(model.geom_dataid[geom])
        first, count = int(mesh.vertadr[0]), int(mesh.vertnum[0])
        face, faces = int(mesh.faceadr[0]), int(mesh.facenum[0])
        return trimesh.Trimesh(
            model.mesh_vert[first : first + count], model.mesh_face[face : face + faces],
            process=False,
        )  # fmt: skip
    return None


def _standing(simulated: SimulationResult) -> list[Shape]:
    """The column of the arm's base and what the object stands on, to see where the floor is."""
    place = simulated.placement
    x, y, z = place.base_m
    stand, (radius, height) = place.stand_m, _TABLE_M
    pieces = [((x, y), 0.0, z, COLUMN_RADIUS_M), ((0.0, 0.0), stand - height, stand, radius)]
    pieces.append(((0.0, 0.0), 0.0, stand - height, 0.3 * radius))
    made = []
    for (px, py), low, high, wide in pieces:
        if high - low > 1e-3:
            mesh = trimesh.creation.cylinder(wide, high - low, sections=2 * _SECTIONS)
            vertices = mesh.vertices + np.array([px, py, (low + high) / 2])
            made.append(
                Shape(FLOOR, vertices.astype(np.float32), np.asarray(mesh.faces, np.uint32), _GREY)
            )
    return made


def _upright(simulated: SimulationResult) -> np.ndarray:
    """T_cell_object (4, 4) before the turntable has turned."""
    place = simulated.placement
    poses = place.T_cell_object(simulated.distance_field, simulated.simulation_job.upright)
    back = np.eye(4)
    back[:3, :3] = Rotation.from_euler("z", -place.turntable_rad[0]).as_matrix()
    return np.asarray(back @ poses[0])


def _unreached(path: SimulatedPath) -> np.ndarray:
    """Waypoints (k, 3) that are not reached, on the surface."""
    positions = [
        _on_surface(path, group.process)[verdict != "reached"]
        for group, verdict in zip(path.path.groups, path.metrics.verdicts, strict=True)
    ]
    return np.concatenate([np.zeros((0, 3)), *positions])


def _lines(path: SimulatedPath) -> dict[int, list[np.ndarray]]:
    lines: dict[int, list[np.ndarray]] = defaultdict(list)
    for group in path.path.groups:
        lines[group.process.line].append(_on_surface(path, group.process))
    return dict(lines)


def _on_surface(path: SimulatedPath, segment: Segment) -> np.ndarray:
    return np.asarray(segment.positions + path.strategy.standoff_m * segment.axes)


def _rgb(colour: np.ndarray) -> tuple[int, int, int]:
    r, g, b = (round(255 * float(c)) for c in colour[:3])
    return (r, g, b)
