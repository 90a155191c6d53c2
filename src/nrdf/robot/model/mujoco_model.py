"""MuJoCo, imported when it is needed, and URDF or MJCF files read as its specifications."""

from __future__ import annotations

import importlib
import os
import sys
from pathlib import Path
from typing import Any

from nrdf.errors import RobotError

_LARGEST_FILE = 1 << 24


class _Lazy:
    """The module `mujoco`, imported at the first use.

    MuJoCo looks at MUJOCO_GL once, on import. Without a display only EGL draws, and the default
    would not.
    """

    def __getattr__(self, name: str) -> Any:
        if "mujoco" not in sys.modules and sys.platform == "linux":
            shown = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
            if not shown:
                os.environ.setdefault("MUJOCO_GL", "egl")
        try:
            return getattr(importlib.import_module("mujoco"), name)
        except ImportError as error:
            raise RobotError(
                f"simulation needs the package mujoco ({error}): pip install 'nrdf[robot]'"
            ) from None


mujoco: Any = _Lazy()


def read_arm_file(file: Path) -> tuple[Any, list[str]]:
    """A URDF's or MJCF's specification without meshes that are not there, and what to tell of them.

    Raises RobotError for a file that is not there, too large, or does not load.
    """
    if not file.is_file():
        raise RobotError(f"no robot file {file}; give a URDF or MJCF file, or none for the bundled")
    if file.stat().st_size > _LARGEST_FILE:
        raise RobotError(f"{file} is larger than {_LARGEST_FILE >> 20} MiB: no robot description")
    try:
        spec = mujoco.MjSpec.from_file(str(file))
    except Exception as error:  # MuJoCo raises whatever its parsers raise
        raise RobotError(
            f"{file} does not load as URDF or MJCF: {_first_line(error)}; a xacro file must be "
            "turned into URDF first"
        ) from None
    spec.compiler.fusestatic = False
    missing = {}
    for mesh in list(spec.meshes):
        name = str(mesh.file)
        found = _mesh_file(file.parent, spec.meshdir, name)
        if found is None:
            missing[mesh.name] = name
        elif name:
            mesh.file = str(found)
    for geom in list(spec.geoms):
        if geom.meshname in missing:
            spec.delete(geom)
    for mesh in list(spec.meshes):
        if mesh.name in missing:
            spec.delete(mesh)
    messages = []
    if missing:
        names = ", ".join(sorted(missing.values())[:3])
        messages.append(
            f"{len(missing)} meshes of {file.name} are not there or not STL or OBJ ({names}): "
            "collisions of these shapes are not seen"
        )
    return spec, messages


def _mesh_file(folder: Path, meshdir: str, name: str) -> Path | None:
    """Where a mesh is: URDF names them from a package's folder, which may be anywhere above."""
    tail = Path(name.split("://", 1)[-1])
    if tail.suffix.lower() not in (".stl", ".obj", ".msh"):
        return None
    candidates = [folder / meshdir / tail, folder / meshdir / tail.name]
    for above in (folder, *folder.parents[:3]):
        candidates += [above / tail, above / Path(*tail.parts[1:])]
    return next((path.resolve() for path in candidates if path.is_file()), None)


def delete_scene_parts(spec: Any) -> None:
    """Leave out what belongs to a scene rather than to the arm: floors, lights, its own motors."""
    for geom in list(spec.worldbody.geoms):
        if geom.type == mujoco.mjtGeom.mjGEOM_PLANE:
            spec.delete(geom)
    for part in (*spec.lights, *spec.cameras, *spec.keys, *spec.actuators, *spec.sensors):
        spec.delete(part)


def compile_arm(spec: Any, file: Path) -> Any:
    """MuJoCo's model of a specification read from `file`; raises RobotError if there is none."""
    try:
        return spec.compile()
    except Exception as error:
        raise RobotError(f"{file} does not load: {_first_line(error)}") from None


def _first_line(error: Exception) -> str:
    return " ".join(str(error).split())[:300]
