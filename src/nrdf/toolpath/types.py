"""Tool paths: what planning produces, reports judge, and exports write; and their file."""

from __future__ import annotations

import json
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    Field,
    ValidationError,
)
from scipy.spatial.transform import Rotation

from nrdf.errors import ProcessError
from nrdf.geometry.similarity import Similarity
from nrdf.io.files import read_file, require_file
from nrdf.io.ply import write_atomically
from nrdf.io.schema import Location, Strict, explain

VERSION = 2
"""Since 2 a job says how its object lies in its frame (`Job.pose`)."""
FILE = "toolpaths.json"
SegmentKind = Literal["approach", "process", "retract"]
_LARGEST_FILE = 1 << 28
_MOST_COMPLAINTS = 5
_SAME_UP = 1e-6


@dataclass(frozen=True)
class Segment:
    """One stretch of a tool path, driven at one speed.

    kind: "approach" and "retract" move freely, "process" works on the surface.
    line: number, from 0, of the line (stroke) of its path that the segment belongs to.
    positions: (n, 3) of the tool centre point, m, in the job's frame.
    quaternions_xyzw: (n, 4) unit, rotation from the tool frame to the job's frame. Tool z points
        along the tool's axis *into* the part, tool x along the travel, tool y completes a
        right-handed frame.
    feed_m_s: speed of the tool centre point.
    force_n: contact force along tool z, at least 0, or None where nothing is touched.
    dwell_s: pause at the segment's last waypoint.
    """

    kind: SegmentKind
    line: int
    positions: np.ndarray
    quaternions_xyzw: np.ndarray
    feed_m_s: float
    force_n: float | None = None
    dwell_s: float = 0.0


@dataclass(frozen=True)
class ToolPath:
    """All of one process step on one region.

    region: its name. process: the label of the process that made it ("sand", "paint 2", ...), which
    no other process on that region has. tool: the tool's name.
    tool_radius_m: radius of its footprint. spindle_rad_s: None where nothing turns.
    segments: in the order in which they are driven. parameters: free custom parameters.
    tcp_m, tcp_quaternion_xyzw: the tool frame in the robot's flange frame, None where not known.
    force_tolerance_n: how far the contact force may be off.
    """

    region: str
    process: str
    tool: str
    tool_radius_m: float
    segments: tuple[Segment, ...]
    spindle_rad_s: float | None = None
    parameters: dict[str, Any] = field(default_factory=dict)
    tcp_m: tuple[float, float, float] | None = None
    tcp_quaternion_xyzw: tuple[float, float, float, float] | None = None
    force_tolerance_n: float | None = None


@dataclass(frozen=True)
class Job:
    """Tool paths for one object, in the order in which they are driven.

    category: what the object is. frame: name of the frame that positions are in (the target
    cloud's own). paths: in order. pose: of the object in that frame, from canonical coordinates (+X
    forward, +Y up, longest side 1), m; None in a job that does not say: an early file.
    """

    category: str
    frame: str
    paths: tuple[ToolPath, ...]
    pose: Similarity | None = None

    @property
    def up(self) -> np.ndarray:
        """The direction (3,) in the frame that is up for the object; +Y where the job does not say
        how it lies."""
        return np.eye(3)[1] if self.pose is None else self.pose.rotation[:, 1]

    @property
    def forward(self) -> np.ndarray:
        """The direction (3,) in the frame that the object faces; +X where the job does not say."""
        return np.eye(3)[0] if self.pose is None else self.pose.rotation[:, 0]


def read_toolpaths(folder: str | Path) -> Job:
    """The job that `write_toolpaths` left in a folder (or the path of its file itself).

    Raises ProcessError where there is none, where it is larger than 256 MiB, where a newer version
    wrote it, and for a field that is missing, unknown or impossible, naming it.
    """
    path = Path(folder)
    if path.is_dir() or not path.exists():
        path = path / FILE
    try:
        if require_file(path, ProcessError) > _LARGEST_FILE:
            raise ProcessError(
                f"{path} is larger than {_LARGEST_FILE >> 20} MiB: no file of tool paths"
            )
        text = read_file(path, ProcessError, _LARGEST_FILE)
    except ProcessError as error:
        raise ProcessError(
            f"cannot read the tool paths: {error}; give the folder that `nrdf transfer` wrote"
        ) from None
    return _parse(text, str(path))


def write_toolpaths(folder: str | Path, job: Job) -> Path:
    """Write `job` into an existing folder as toolpaths.json; the file's path.

    `read_toolpaths` gives exactly the same back, but for the last digits of the pose's rotation.
    Raises ProcessError, naming the field, for what `read_toolpaths` would refuse, and OutputError
    where the folder cannot be written.
    """
    path = Path(folder) / FILE
    content = {"version": VERSION, **_plain(job)}
    try:
        text = json.dumps(content, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    except (TypeError, ValueError) as error:
        raise ProcessError(f"tool paths that no JSON file can hold: {error}") from None
    encoded = text.encode()
    _parse(encoded, "the job")
    write_atomically(path, [encoded + b"\n"])
    return path


def pose_of(pose: Similarity | None) -> dict[str, Any] | None:
    """An object's pose as files have it: canonical coordinates times ``scale_m``, turned by the
    quaternion and moved, are those in the object's frame."""
    if pose is None:
        return None
    return {
        "quaternion_xyzw": Rotation.from_matrix(pose.rotation).as_quat().tolist(),
        "translation_m": np.asarray(pose.translation).tolist(),
        "scale_m": float(pose.scale),
        "up": pose.rotation[:, 1].tolist(),
    }


_KEYS = {"positions": "positions_m"}
"""Fields whose name in the file says the unit that the docstring says here."""


def _plain(value: Any) -> Any:
    """A job or a part of it as JSON has it."""
    if isinstance(value, (Job, ToolPath, Segment)):
        names = [item.name for item in fields(value)]
        return {_KEYS.get(name, name): _plain(getattr(value, name)) for name in names}
    if isinstance(value, Similarity):
        return pose_of(value)
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (tuple, list)):
        return [_plain(item) for item in value]
    return value


def _printable(name: str) -> str:
    # Names end up in robot programs, where a line break would begin a new statement.
    if not name.isprintable():
        raise ValueError("a name with line breaks or other characters that cannot be printed")
    return name


def _unit(quaternion: tuple[float, ...]) -> tuple[float, ...]:
    length = sum(x * x for x in quaternion) ** 0.5
    if abs(length - 1.0) > 1e-6:
        raise ValueError(f"a quaternion of length {length:.6g}, not 1")
    return quaternion


_Name = Annotated[str, Field(min_length=1, max_length=200), AfterValidator(_printable)]
_Position = tuple[float, float, float]
_Quaternion = Annotated[tuple[float, float, float, float], AfterValidator(_unit)]
_AtLeastZero = Annotated[float, Field(ge=0)]
_AboveZero = Annotated[float, Field(gt=0)]


class _Version(BaseModel):
    version: int


class _SegmentContent(Strict):
    kind: SegmentKind
    line: int = Field(ge=0)
    positions_m: list[_Position] = Field(min_length=1)
    quaternions_xyzw: list[_Quaternion]
    feed_m_s: _AboveZero
    force_n: _AtLeastZero | None = None
    dwell_s: _AtLeastZero = 0.0

    def made(self, where: str) -> Segment:
        if len(self.positions_m) != len(self.quaternions_xyzw):
            raise ProcessError(
                f"{where} has {len(self.positions_m)} positions_m, but "
                f"{len(self.quaternions_xyzw)} quaternions_xyzw; each position needs one"
            )
        content = {name: getattr(self, name) for name in type(self).model_fields}
        positions = np.array(content.pop("positions_m"), dtype=np.float64)
        content["quaternions_xyzw"] = np.array(content["quaternions_xyzw"], dtype=np.float64)
        return Segment(positions=positions, **content)


class _PathContent(Strict):
    region: _Name
    process: _Name
    tool: _Name
    tool_radius_m: _AboveZero
    segments: list[_SegmentContent]
    spindle_rad_s: _AtLeastZero | None = None
    parameters: dict[str, Any] = Field(default_factory=dict)
    tcp_m: _Position | None = None
    tcp_quaternion_xyzw: _Quaternion | None = None
    force_tolerance_n: _AboveZero | None = None

    def made(self, where: str) -> ToolPath:
        content = {name: getattr(self, name) for name in type(self).model_fields}
        segments = enumerate(content.pop("segments"))
        made = tuple(segment.made(f"{where}.segments[{i}]") for i, segment in segments)
        return ToolPath(segments=made, **content)


class _PoseContent(Strict):
    quaternion_xyzw: _Quaternion
    translation_m: _Position
    scale_m: _AboveZero
    up: _Position

    def made(self, where: str) -> Similarity:
        rotation = Rotation.from_quat(self.quaternion_xyzw).as_matrix()
        if np.abs(rotation[:, 1] - self.up).max() > _SAME_UP:
            turned = " ".join(f"{x:.4g}" for x in rotation[:, 1])
            raise ProcessError(
                f"{where} contradicts itself: up is {' '.join(f'{x:.4g}' for x in self.up)}, but "
                f"its quaternion takes +Y to {turned}"
            )
        return Similarity(rotation, np.array(self.translation_m), self.scale_m)


class _JobContent(_Version, Strict):
    category: _Name
    frame: _Name
    paths: list[_PathContent]
    pose: _PoseContent | None = None


def _place(location: Location) -> str:
    """paths[0].segments[2].feed_m_s"""
    parts = (f"[{part}]" if isinstance(part, int) else f".{part}" for part in location)
    return "".join(parts).removeprefix(".")


def _parse(text: bytes, origin: str) -> Job:
    try:
        version = _Version.model_validate_json(text).version
        if version > VERSION:
            raise ProcessError(
                f"{origin} has version {version}; this nrdf reads versions up to {VERSION}: "
                "update nrdf, or write the job again with this one"
            )
        content = _JobContent.model_validate_json(text)
    except ValidationError as error:
        lines = explain(error, _JobContent, _place)[:_MOST_COMPLAINTS]
        raise ProcessError(f"{origin}: " + "; ".join(lines)) from None
    paths = (path.made(f"{origin}: paths[{i}]") for i, path in enumerate(content.paths))
    pose = None if content.pose is None else content.pose.made(f"{origin}: pose")
    return Job(content.category, content.frame, tuple(paths), pose)
