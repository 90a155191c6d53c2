"""The file of a job's tool paths, `toolpaths.json`: written, read and checked."""

from __future__ import annotations

import json
from dataclasses import fields
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    Field,
    ValidationError,
)
from scipy.spatial.transform import Rotation

from nrdf.errors import ProcessError
from nrdf.geometry.similarity import Similarity
from nrdf.io.atomic import write_atomically
from nrdf.io.files import read_file, require_file
from nrdf.io.schema import Location, StrictModel, validation_messages
from nrdf.toolpath.strategy import (
    LARGEST_TURN_RAD_M,
    RESAMPLE_TURN_RAD,
    DirectionMode,
    Heading,
    LineOrder,
    Start,
    Strategy,
    Trajectory,
)
from nrdf.toolpath.types import Job, Segment, SegmentKind, ToolPath

VERSION = 6
"""Since 2 a job says how its object lies in its frame (`Job.pose`); since 3 a path has its
strategy; since 4 that has the settings of modifiers; since 5 waypoints may have feeds of their own
and be off the surface, a strategy has an origin and resampling, and a path the kind of its
process; since 6 waypoints may have their tool off."""
FILE = "toolpaths.json"
_LARGEST_FILE = 1 << 28
_MOST_COMPLAINTS = 5
_SAME_UP = 1e-6


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
    """Write the file of `job` into an existing folder; returns its path.

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


def pose_to_dict(pose: Similarity | None) -> dict[str, Any] | None:
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
    """A job, or a part of it, as values that JSON has."""
    if isinstance(value, (Job, ToolPath, Segment, Strategy)):
        names = [item.name for item in fields(value)]
        return {_KEYS.get(name, name): _plain(getattr(value, name)) for name in names}
    if isinstance(value, Similarity):
        return pose_to_dict(value)
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


def _early_kind(kind: Any) -> Any:
    """Files of version 1 and 2 call a retract "departure"."""
    return "retract" if kind == "departure" else kind


class _SegmentContent(StrictModel):
    kind: Annotated[SegmentKind, BeforeValidator(_early_kind)]
    line: int = Field(ge=0)
    positions_m: list[_Position] = Field(min_length=1)
    quaternions_xyzw: list[_Quaternion]
    feed_m_s: _AboveZero
    force_n: _AtLeastZero | None = None
    dwell_s: _AtLeastZero = 0.0
    feeds_m_s: list[_AboveZero] | None = None
    on_surface: list[bool] | None = None
    tool_on: list[bool] | None = None

    def made(self, where: str) -> Segment:
        if len(self.positions_m) != len(self.quaternions_xyzw):
            raise ProcessError(
                f"{where} has {len(self.positions_m)} positions_m, but "
                f"{len(self.quaternions_xyzw)} quaternions_xyzw; each position needs one"
            )
        content = {name: getattr(self, name) for name in type(self).model_fields}
        positions = np.array(content.pop("positions_m"), dtype=np.float64)
        content["quaternions_xyzw"] = np.array(content["quaternions_xyzw"], dtype=np.float64)
        for name, kind in (("feeds_m_s", np.float64), ("on_surface", bool), ("tool_on", bool)):
            values = content[name]
            if values is None:
                continue
            if len(values) != len(positions):
                raise ProcessError(
                    f"{where} has {len(positions)} positions_m, but {len(values)} {name}; each "
                    "position needs one, or leave them out"
                )
            content[name] = np.array(values, dtype=kind)
        return Segment(positions=positions, **content)


class _StrategyContent(StrictModel):
    trajectory: Trajectory
    direction: _Position | None
    stepover_m: float
    spacing_m: float
    edge_margin_m: float
    tool_radius_m: float
    clearance_m: float
    lead_rad: float
    tilt_rad: float
    standoff_m: float
    passes: int
    feed_m_s: float
    force_n: _AtLeastZero | None
    dwell_s: float
    approach_distance_m: float
    approach_angle_rad: float
    approach_feed_m_s: float
    retract_distance_m: float
    retract_angle_rad: float
    retract_feed_m_s: float
    # Since version 4 and 5, so with the values that earlier paths were made with.
    direction_mode: DirectionMode = "taught"
    start: Start | None = None
    origin_m: _Position | None = None
    line_order: LineOrder = "snake"
    heading: Heading = "travel"
    steady_m: float = 0.0
    run_off_m: float = 0.0
    run_off_height_m: float = 0.0
    lead_in_radius_m: float = 0.0
    lead_out_radius_m: float = 0.0
    offset_m: float = 0.0
    drag_m: float = 0.0
    edge_contact_m: float = 0.0
    largest_turn_rad_m: float = LARGEST_TURN_RAD_M
    chord_error_m: float = 0.0
    resample_step_m: float = 0.0
    resample_turn_rad: float = RESAMPLE_TURN_RAD
    minimum_length_m: float | None = None
    join_gap_m: float | None = None
    constant_speed: bool = False
    body_radius_m: float = 0.0
    body_length_m: float = 0.0

    def made(self, where: str) -> Strategy:
        content = {name: getattr(self, name) for name in type(self).model_fields}
        if self.direction is not None:
            content["direction"] = np.array(self.direction)
        if self.origin_m is not None:
            content["origin_m"] = np.array(self.origin_m)
        try:
            return Strategy(**content)
        except ProcessError as error:
            raise ProcessError(f"{where}: {error}") from None


class _PathContent(StrictModel):
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
    strategy: _StrategyContent | None = None
    process_kind: _Name | None = None

    def made(self, where: str) -> ToolPath:
        content = {name: getattr(self, name) for name in type(self).model_fields}
        segments = enumerate(content.pop("segments"))
        made = tuple(segment.made(f"{where}.segments[{i}]") for i, segment in segments)
        if self.strategy is not None:
            content["strategy"] = self.strategy.made(f"{where}.strategy")
        return ToolPath(segments=made, **content)


class _PoseContent(StrictModel):
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


class _JobContent(_Version, StrictModel):
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
        lines = validation_messages(error, _JobContent, _place)[:_MOST_COMPLAINTS]
        raise ProcessError(f"{origin}: " + "; ".join(lines)) from None
    paths = (path.made(f"{origin}: paths[{i}]") for i, path in enumerate(content.paths))
    pose = None if content.pose is None else content.pose.made(f"{origin}: pose")
    return Job(content.category, content.frame, tuple(paths), pose)
