"""Metrics of a simulated tool path: waypoints reached, force, coverage, time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from nrdf.geometry.polylines import arc_length, even_arc_lengths, interpolate
from nrdf.robot.model.cell import Cell
from nrdf.robot.planning.inverse_kinematics import pose_errors
from nrdf.robot.planning.program import PathProgram
from nrdf.robot.planning.reachability import Reachability
from nrdf.robot.planning.timing import STEP_S
from nrdf.robot.simulation.execute import ExecutionLog
from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.region_samples import Coverage, RegionSamples
from nrdf.toolpath.sampled_path import reached_points
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.types import SegmentGroup, ToolPath

Verdict = Literal["reached", "limit", "singular", "collision", "too fast"]
VERDICTS: tuple[Verdict, ...] = ("reached", "limit", "singular", "collision", "too fast")
FORCE_BAND = 0.2
"""Share of the commanded force that it may be off."""
TOO_SLOW = 0.5
"""Share of its feed below which the joints' speed limits make a waypoint too fast for the arm."""
_TILTED_RAD = np.radians(0.1)
_PRESSES = 0.3  # share of the commanded force from which the surface counts as worked
_ON_PLAN_M = 0.003
_FINE_M = 0.005


@dataclass(frozen=True)
class PathMetrics:
    """Metrics of one tool path.

    verdicts: for each segment group, of its waypoints. position_error_m, axis_error_rad: the worst
    of reached waypoints, of the planned joints, against the axis that they are planned with;
    tilted: waypoints where that is not the tool path's own, by max_tilt_rad at most. planned,
    executed, achieved: coverage of the whole region by the tool path, by the part of it that is
    executed, and in the simulation. samples: (k,) even points of the region's mesh; worked: (k,)
    those worked in the simulation.
    force_*: while the tool moves along its lines; None where nothing is pressed. off_plan_99_m: of
    the tool from its line, without the offset along the axis.
    """

    verdicts: tuple[np.ndarray, ...]
    reached: int
    waypoints: int
    joint_paths: int
    position_error_m: float
    axis_error_rad: float
    tilted: int
    max_tilt_rad: float
    planned: Coverage
    executed: Coverage
    achieved: Coverage
    samples: RegionSamples
    worked: np.ndarray
    force_commanded_n: float | None
    force_mean_n: float | None
    force_spread_n: float | None
    force_within: float | None
    contact_s: float
    settling_s: float
    off_plan_99_m: float
    slow_share: float
    seconds: dict[str, float]

    @property
    def cycle_time_s(self) -> float:
        """Of all actions."""
        return sum(self.seconds.values())

    def count(self, verdict: Verdict) -> int:
        """How many waypoints have a verdict."""
        return int(sum((line == verdict).sum() for line in self.verdicts))


def measure_path(
    region: RegionMesh,
    path: ToolPath,
    strategy: Strategy,
    cell: Cell,
    program: PathProgram,
    covered: Sequence[np.ndarray],
    reachability: Sequence[Reachability],
    logs: Sequence[ExecutionLog],
) -> PathMetrics:
    """Metrics of a tool path that was executed.

    region: whose parent is the object's true mesh. covered, reachability: as `plan_joint_paths`
    returns them.
    """
    groups = path.groups
    verdicts = _verdicts(groups, program, covered, reachability)
    distance, angle = _errors(cell, groups, program)
    tilts = _tilts(groups, program)
    samples = RegionSamples.of(region, strategy)
    height = strategy.standoff_m

    def reached(positions: np.ndarray, axes: np.ndarray) -> np.ndarray:
        return reached_points(samples.points, samples.normals, positions, axes, path.tool_radius_m)

    planned = [(group.process.positions, group.process.axes) for group in groups]
    executed = [
        (groups[p.group].process.positions[p.first : p.last + 1], p.axes)
        for p in program.joint_paths
    ]
    process_logs = [log for log in logs if log.action.kind == "process"]
    worked = reached(*_working(process_logs, height))
    pressing = [log for log in process_logs if log.action.force_n is not None]
    commanded = pressing[0].action.force_n if pressing else None
    force = np.concatenate([log.force_n[log.working] for log in pressing] or [np.zeros(0)])
    within = np.abs(force - (commanded or 0.0)) <= FORCE_BAND * (commanded or 0.0)
    off = np.concatenate([log.off_m for log in process_logs] or [np.zeros(1)])
    slowed = [log.action.timed.slowed for log in process_logs] or [np.zeros(1, bool)]
    seconds: dict[str, float] = {}
    for log in logs:
        kind = log.action.kind
        seconds[kind] = seconds.get(kind, 0.0) + len(log.joints) * STEP_S
    moved = sum(int(log.working.sum()) for log in pressing) * STEP_S
    return PathMetrics(
        verdicts=verdicts,
        reached=int(sum((verdict == "reached").sum() for verdict in verdicts)),
        waypoints=sum(len(group.process.positions) for group in groups),
        joint_paths=len(program.joint_paths),
        position_error_m=distance,
        axis_error_rad=angle,
        tilted=int((tilts > _TILTED_RAD).sum()),
        max_tilt_rad=float(tilts.max(initial=0.0)),
        planned=samples.coverage(reached(*_sampled(planned, height))),
        executed=samples.coverage(reached(*_sampled(executed, height))),
        achieved=samples.coverage(worked),
        samples=samples,
        worked=worked & samples.accessible,
        force_commanded_n=commanded,
        force_mean_n=float(force.mean()) if len(force) else None,
        force_spread_n=float(force.std()) if len(force) else None,
        force_within=float(within.mean()) if len(force) else None,
        contact_s=moved,
        settling_s=sum(len(log.joints) for log in pressing) * STEP_S - moved,
        off_plan_99_m=float(np.quantile(off, 0.99)),
        slow_share=float(np.concatenate(slowed).mean()),
        seconds=seconds,
    )


def _verdicts(
    groups: Sequence[SegmentGroup],
    program: PathProgram,
    covered: Sequence[np.ndarray],
    reachability: Sequence[Reachability],
) -> tuple[np.ndarray, ...]:
    executed = [np.zeros(len(group.process.positions), bool) for group in groups]
    for path in program.joint_paths:
        executed[path.group][path.first : path.last + 1] = True
    made = []
    for does, done, found in zip(executed, covered, reachability, strict=True):
        verdict = np.full(len(done), "reached", dtype="<U9")
        verdict[done & ~does] = "collision"  # no free move leads there, or it was rejected
        verdict[~done & found.regular] = "collision"  # on the approach or the retract
        verdict[~done & ~found.regular] = "singular"
        verdict[~done & ~found.collision_free] = "collision"
        verdict[~done & ~found.solved] = "limit"
        made.append(verdict)
    for action in program.actions:
        if action.kind == "process":
            part = made[action.group][action.first : action.first + len(action.timed.slowed)]
            part[action.timed.feed_share < TOO_SLOW] = "too fast"
    return tuple(made)


def _errors(
    cell: Cell, groups: Sequence[SegmentGroup], program: PathProgram
) -> tuple[float, float]:
    """The worst distance and angle between planned joints and their waypoints."""
    distance, angle = 0.0, 0.0
    for path in program.joint_paths:
        positions = groups[path.group].process.positions[path.first : path.last + 1]
        index = np.full(len(path.joints), path.turntable_index)
        at, along = cell.to_base(index, positions, path.axes)
        off, turned = pose_errors(cell.chain.frames(path.joints), at, along)
        distance, angle = max(distance, float(off.max())), max(angle, float(turned.max()))
    return distance, angle


def _tilts(groups: Sequence[SegmentGroup], program: PathProgram) -> np.ndarray:
    """Angles (k,), rad, between executed and planned axes of all executed waypoints."""
    tilts = [np.zeros(0)]
    for path in program.joint_paths:
        planned = groups[path.group].process.axes[path.first : path.last + 1]
        cosine = np.einsum("na,na->n", path.axes, planned)
        sine = np.linalg.norm(np.cross(path.axes, planned), axis=1)
        tilts.append(np.arctan2(sine, cosine))
    return np.concatenate(tilts)


def _sampled(
    parts: Sequence[tuple[np.ndarray, np.ndarray]], height: float
) -> tuple[np.ndarray, np.ndarray]:
    """The tool's positions and axes, sampled finely along waypoints (n, 3) and axes (n, 3)."""
    positions: list[np.ndarray] = [np.zeros((0, 3))]
    axes: list[np.ndarray] = [np.zeros((0, 3))]
    for waypoints, own in parts:
        along = arc_length(waypoints)
        at = even_arc_lengths(float(along[-1]), _FINE_M)
        point, axis = interpolate(at, along, waypoints), interpolate(at, along, own)
        positions.append(point + height * axis)
        axes.append(axis)
    return np.concatenate(positions), np.concatenate(axes)


def _working(logs: Sequence[ExecutionLog], height: float) -> tuple[np.ndarray, np.ndarray]:
    """The tool's positions and axes where it really worked."""
    positions: list[np.ndarray] = [np.zeros((0, 3))]
    axes: list[np.ndarray] = [np.zeros((0, 3))]
    for log in logs:
        commanded = log.action.force_n
        force_n = log.force_n
        works = log.off_m < _ON_PLAN_M if commanded is None else force_n > _PRESSES * commanded
        positions.append((log.tip + height * log.axis)[works][::3])
        axes.append(log.axis[works][::3])
    return np.concatenate(positions), np.concatenate(axes)
