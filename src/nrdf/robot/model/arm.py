"""An arm: the bundled one, or any URDF or MJCF, checked as it is loaded."""

from __future__ import annotations

import itertools
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from nrdf.errors import RobotError, unknown_name
from nrdf.robot.model.kinematics import Chain
from nrdf.robot.model.mujoco_model import compile_arm, delete_scene_parts, mujoco, read_arm_file
from nrdf.robot.model.spheres import COARSE, FINE, Spheres, cover_box, cover_capsule, cover_cylinder

BUNDLED = Path(__file__).with_name("ur10e.xml")
_USUAL_SPEED = np.pi  # rad/s (or m/s), where a file gives none
_SPEEDS = "joint_speed_limits"
_FRAMES = ("flange", "tool0", "tool_flange", "attachment_site", "ee_link", "link_ee")
_SAME = 1e-6  # m, between our forward kinematics and MuJoCo's


@dataclass(frozen=True)
class Arm:
    """An arm of six or seven axes, its base at the origin, z up.

    spec: the MuJoCo specification, without tool. joint_names: of the chain, base first. body:
    name of the body that the tool is mounted on; T_body_flange: (4, 4), of the tool frame in it.
    spheres: around the arm's own shapes; coarse_spheres: the same with fewer, larger ones. checked:
    what was found on loading, in words; warnings: what a person should know before trusting
    results.
    """

    name: str
    spec: Any
    chain: Chain
    joint_names: tuple[str, ...]
    tool_frame: str
    body: str
    T_body_flange: np.ndarray
    spheres: Spheres
    coarse_spheres: Spheres
    checked: tuple[str, ...]
    warnings: tuple[str, ...] = field(default=())


def load_arm(path: str | Path | None = None, tool_frame: str | None = None) -> Arm:
    """The bundled arm, or that of a URDF or MJCF file.

    Raises RobotError for a file that does not load, a tool frame that does not exist (listing those
    that do), joints that neither turn nor slide, and any number of axes but six or seven.
    """
    file = BUNDLED if path is None else Path(path)
    spec, warnings = read_arm_file(file)
    delete_scene_parts(spec)
    model = compile_arm(spec, file)
    frame, is_site = _tool_frame(model, tool_frame, file)
    chosen = _joints(model, frame, is_site, file)
    names = tuple(model.joint(i).name for i in chosen)
    warnings += _drop_other_joints(spec, model, chosen)
    model = compile_arm(spec, file)
    chosen = [model.joint(name).id for name in names]
    speeds, messages = _speed_limits(file, model, names)
    warnings += messages
    chain, frames = _chain(model, chosen, frame, is_site, speeds)
    _check_kinematics(model, chain, chosen, frame, is_site, file)
    spheres, shapes = _spheres(model, chosen, frames, FINE)
    if not len(spheres.radii):
        warnings.append(f"{file.name} has no shapes: only the tool is checked for collisions")
    body = model.site_bodyid[model.site(frame).id] if is_site else model.body(frame).id
    T_world_body = _pose_of_body(model, body)
    T_world_tool = frames[-1] @ chain.T_last_tool
    ranges = ", ".join(
        f"{name} {np.degrees(low):.0f}° to {np.degrees(high):.0f}°, {np.degrees(speed):.0f}°/s"
        for name, low, high, speed in zip(
            names, chain.lower, chain.upper, chain.speeds, strict=True
        )
    )
    reach = float(np.linalg.norm(chain.origins[1:, :3, 3], axis=1).sum())
    checked = (
        f"{len(names)} axes from the base to the tool frame '{frame}': {ranges}",
        f"forward kinematics agree with MuJoCo's to {_SAME * 1e3:g} mm in 20 random configurations",
        f"{shapes} shapes for collisions, enclosed in {len(spheres.radii)} spheres for planning",
        f"links add up to {reach:.2f} m",
    )
    return Arm(
        name=spec.modelname or file.stem,
        spec=spec,
        chain=chain,
        joint_names=names,
        tool_frame=frame,
        body=model.body(body).name,
        T_body_flange=np.linalg.inv(T_world_body) @ T_world_tool,
        spheres=spheres,
        coarse_spheres=_spheres(model, chosen, frames, COARSE)[0],
        checked=checked,
        warnings=tuple(warnings),
    )


def _tool_frame(model: Any, wanted: str | None, file: Path) -> tuple[str, bool]:
    """Name of the tool frame, and whether it is a site."""
    sites = [model.site(i).name for i in range(model.nsite) if model.site(i).name]
    bodies = [model.body(i).name for i in range(1, model.nbody) if model.body(i).name]
    if wanted is not None:
        if wanted in sites:
            return wanted, True
        if wanted in bodies:
            return wanted, False
        raise RobotError(f"{file.name}: " + unknown_name("tool frame", wanted, [*sites, *bodies]))
    for name in _FRAMES:
        if name in sites or name in bodies:
            return name, name in sites
    parents = set(model.body_parentid[1:].tolist())
    ends = [model.body(i).name for i in range(1, model.nbody) if i not in parents]
    if len(ends) == 1 and ends[0]:
        return ends[0], False
    raise RobotError(
        f"{file.name} does not tell where a tool is mounted: give --tool-frame, one of "
        f"{', '.join([*sites, *bodies])}"
    )


def _joints(model: Any, frame: str, is_site: bool, file: Path) -> list[int]:
    """Joints between the base and the tool frame, base first."""
    body = model.site_bodyid[model.site(frame).id] if is_site else model.body(frame).id
    chosen: list[int] = []
    while body > 0:
        first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
        chosen = [*range(first, first + count), *chosen] if count else chosen
        body = model.body_parentid[body]
    allowed = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
    for joint in chosen:
        if model.jnt_type[joint] not in allowed:
            raise RobotError(
                f"{file.name}: the joint '{model.joint(joint).name}' neither turns nor slides; an "
                "arm on a fixed base is needed"
            )
        if not model.joint(joint).name:
            raise RobotError(f"{file.name}: a joint without a name; name all of them")
    if len(chosen) not in (6, 7):
        names = ", ".join(model.joint(j).name for j in chosen) or "none"
        raise RobotError(
            f"{file.name}: {len(chosen)} axes ({names}) lead to the tool frame '{frame}'; arms of "
            "six or seven are simulated"
        )
    return chosen


def _drop_other_joints(spec: Any, model: Any, chosen: list[int]) -> list[str]:
    """Fix joints that do not move the tool (fingers, say) at zero."""
    kept = {model.joint(j).name for j in chosen}
    others = [joint for joint in spec.joints if joint.name not in kept]
    for part in (*spec.equalities, *spec.tendons):
        spec.delete(part)
    for joint in others:
        spec.delete(joint)
    if not others:
        return []
    return [f"{len(others)} joints do not move the tool frame, and are fixed"]


def _speed_limits(file: Path, model: Any, names: tuple[str, ...]) -> tuple[np.ndarray, list[str]]:
    for i in range(model.nnumeric):
        numeric = model.numeric(i)
        if numeric.name == _SPEEDS and len(numeric.data) == len(names):
            return np.array(numeric.data), []
    found = {}
    text = file.read_bytes()
    if b"<robot" in text:
        for joint in ElementTree.fromstring(text).iter("joint"):
            limit = joint.find("limit")
            value = None if limit is None else limit.get("velocity")
            if value is not None and float(value) > 0.0:
                found[joint.get("name")] = float(value)
    missing = [name for name in names if name not in found]
    speeds = np.array([found.get(name, _USUAL_SPEED) for name in names])
    if not missing:
        return speeds, []
    return speeds, [
        f"{file.name} gives no speed limits for {', '.join(missing)}: taken to be "
        f"{np.degrees(_USUAL_SPEED):.0f}°/s"
    ]


def _at_zero(model: Any) -> Any:
    data = mujoco.MjData(model)
    data.qpos[:] = 0.0
    mujoco.mj_kinematics(model, data)
    return data


def _pose(rotation: np.ndarray, position: np.ndarray) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation.reshape(3, 3), position
    return pose


def _pose_of_body(model: Any, body: int) -> np.ndarray:
    data = _at_zero(model)
    return _pose(data.xmat[body], data.xpos[body])


def _chain(
    model: Any, chosen: list[int], frame: str, is_site: bool, speeds: np.ndarray
) -> tuple[Chain, list[np.ndarray]]:
    """The chain, and the base's and each joint's frame (4, 4) at zero."""
    data = _at_zero(model)
    frames = [np.eye(4)]
    for joint in chosen:
        frames.append(_pose(data.xmat[model.jnt_bodyid[joint]], data.xanchor[joint]))
    origins = [np.linalg.inv(a) @ b for a, b in itertools.pairwise(frames)]
    tool = data.site(frame) if is_site else data.body(frame)
    limited = model.jnt_limited[chosen].astype(bool)
    ranges = np.where(limited[:, None], model.jnt_range[chosen], [-2 * np.pi, 2 * np.pi])
    chain = Chain(
        origins=np.array(origins),
        axes=model.jnt_axis[chosen].copy(),
        slides=model.jnt_type[chosen] == int(mujoco.mjtJoint.mjJNT_SLIDE),
        T_last_tool=np.linalg.inv(frames[-1]) @ _pose(tool.xmat, tool.xpos),
        lower=ranges[:, 0].copy(),
        upper=ranges[:, 1].copy(),
        speeds=speeds,
    )
    return chain, frames


def _check_kinematics(
    model: Any, chain: Chain, chosen: list[int], frame: str, is_site: bool, file: Path
) -> None:
    rng = np.random.default_rng(0)
    joints = rng.uniform(chain.lower, chain.upper, (20, chain.size))
    found = chain.frames(joints)
    data = mujoco.MjData(model)
    for i, values in enumerate(joints):
        data.qpos[model.jnt_qposadr[chosen]] = values
        mujoco.mj_kinematics(model, data)
        tool = data.site(frame) if is_site else data.body(frame)
        off = np.abs(found.tcp[i] - tool.xpos).max()
        turned = np.abs(found.tool[i] - tool.xmat.reshape(3, 3)).max()
        if max(off, turned) > _SAME:
            raise RobotError(f"{file.name} is no serial arm: its tool frame moves otherwise")


def _spheres(
    model: Any, chosen: list[int], frames: list[np.ndarray], step: float
) -> tuple[Spheres, int]:
    """Spheres around the shapes that collide, or around all where none does."""
    data = _at_zero(model)
    owner = np.zeros(model.nbody, int)
    bodies = [int(model.jnt_bodyid[joint]) for joint in chosen]
    for body in range(1, model.nbody):
        owner[body] = owner[model.body_parentid[body]]
        if body in bodies:
            owner[body] = len(bodies) - bodies[::-1].index(body)
    collides = (model.geom_contype | model.geom_conaffinity) > 0
    used = np.flatnonzero(collides if collides.any() else np.ones(model.ngeom, bool))
    made = Spheres.none()
    for geom in used:
        centres, radius = _cover(model, int(geom), step)
        rotation = data.geom_xmat[geom].reshape(3, 3)
        link = owner[model.geom_bodyid[geom]]
        world = centres @ rotation.T + data.geom_xpos[geom]
        local = (world - frames[link][:3, 3]) @ frames[link][:3, :3]
        count = len(local)
        made += Spheres(local, np.full(count, radius), np.full(count, link))
    return made, len(used)


def _cover(model: Any, geom: int, step: float) -> tuple[np.ndarray, float]:
    kind, size = model.geom_type[geom], model.geom_size[geom]
    end = np.array([0.0, 0.0, size[1]])
    if kind == int(mujoco.mjtGeom.mjGEOM_SPHERE):
        return np.zeros((1, 3)), float(size[0])
    if kind == int(mujoco.mjtGeom.mjGEOM_CAPSULE):
        return cover_capsule(-end, end, float(size[0]), step)
    if kind == int(mujoco.mjtGeom.mjGEOM_CYLINDER):
        return cover_cylinder(float(size[0]), float(size[1]), step)
    box = model.geom_aabb[geom]
    centres, radius = cover_box(box[3:], step)
    return centres + box[:3], radius
