"""What came of a tool path: waypoints reached, force, coverage, time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from nrdf.geometry.polylines import arc_length, even_arc_lengths, interpolate
from nrdf.process.bound_knowledge import BoundKnowledge
from nrdf.process.knowledge import Process
from nrdf.robot.model.cell import Cell
from nrdf.robot.planning.lines import Line
from nrdf.robot.planning.program import PathProgram
from nrdf.robot.planning.timing import STEP_S
from nrdf.robot.planning.tracks import Reachability
from nrdf.robot.simulation.execute import Log
from nrdf.surface.surface import Surface
from nrdf.toolpath.metrics import Coverage, RegionPoints
from nrdf.toolpath.sampled_path import reached_points
from nrdf.toolpath.types import ToolPath

Verdict = Literal["reached", "limit", "singular", "collision", "too fast"]
VERDICTS: tuple[Verdict, ...] = ("reached", "limit", "singular", "collision", "too fast")
FORCE_BAND = 0.2
TOO_SLOW = 0.5
"""Share of its feed below which the joints' speed limits make a waypoint too fast for the arm."""
_LEANS_RAD = np.radians(0.1)
_PRESSES = 0.3  # of the commanded force, from which on the surface counts as worked
_ON_PLAN_M = 0.003
_FINE_M = 0.005


@dataclass(frozen=True)
class PathMetrics:
    """Figures of one tool path.

    verdicts: for each line, of its waypoints. position_error_m, axis_error_rad: the worst of
    reached waypoints, of the planned joints, against the axis that they are driven with; leaning:
    waypoints where that is not the planned one, by most_lean_rad at most. planned, driven,
    achieved: what becomes of the whole region by the plan, by what is left of it when it is driven,
    and in the simulation. region_points: (k,) indices of its points on the target (of a large one,
    those that are kept); worked, wanted: (k,) those worked in the simulation, and those that are
    not left out. force_*: while the tool moves along its lines; None where nothing is pressed.
    off_plan_99_m: of the tool from its line, the way along the axis left out.
    """

    verdicts: tuple[np.ndarray, ...]
    reached: int
    waypoints: int
    pieces: int
    position_error_m: float
    axis_error_rad: float
    leaning: int
    most_lean_rad: float
    planned: Coverage
    driven: Coverage
    achieved: Coverage
    region_points: np.ndarray
    worked: np.ndarray
    wanted: np.ndarray
    force_asked_n: float | None
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
        return sum(self.seconds.values())

    def count(self, verdict: Verdict) -> int:
        return int(sum((line == verdict).sum() for line in self.verdicts))


def measure_path(
    lesson: BoundKnowledge,
    surface: Surface,
    path: ToolPath,
    process: Process,
    cell: Cell,
    lines: Sequence[Line],
    program: PathProgram,
    covered: Sequence[np.ndarray],
    why: Sequence[Reachability],
    logs: Sequence[Log],
) -> PathMetrics:
    """Figures of a tool path that was driven."""
    verdicts = _verdicts(lines, program, covered, why)
    away, angle = _errors(cell, lines, program)
    leans = _leans(lines, program)
    wanted = RegionPoints.of(
        surface, lesson.regions[path.region], process.tool.clearance_m, process.edge_margin_m
    )
    points, normals = surface.points[wanted.points], surface.normals[wanted.points]
    height = process.standoff_m

    def reached(places: np.ndarray, axes: np.ndarray) -> np.ndarray:
        return reached_points(points, normals, places, axes, path.tool_radius_m)

    planned = reached(*_swept([(line.positions, line.axes) for line in lines], height))
    parts = [(lines[s.line].positions[s.first : s.last + 1], s.axes) for s in program.strokes]
    driven = reached(*_swept(parts, height))
    work = [log for log in logs if log.action.kind == "process"]
    worked = reached(*_driven(work, height))
    pressing = [log for log in work if log.action.force_n is not None]
    asked = pressing[0].action.force_n if pressing else None
    force = np.concatenate([log.force_n[log.working] for log in pressing] or [np.zeros(0)])
    within = np.abs(force - (asked or 0.0)) <= FORCE_BAND * (asked or 0.0)
    off = np.concatenate([log.off_m for log in work] or [np.zeros(1)])
    slowed = [log.action.timed.slowed for log in work] or [np.zeros(1, bool)]
    seconds: dict[str, float] = {}
    for log in logs:
        kind = log.action.kind
        seconds[kind] = seconds.get(kind, 0.0) + len(log.joints) * STEP_S
    moved = sum(int(log.working.sum()) for log in pressing) * STEP_S
    return PathMetrics(
        verdicts=verdicts,
        reached=int(sum((line == "reached").sum() for line in verdicts)),
        waypoints=sum(len(line.positions) for line in lines),
        pieces=len(program.strokes),
        position_error_m=away,
        axis_error_rad=angle,
        leaning=int((leans > _LEANS_RAD).sum()),
        most_lean_rad=float(leans.max(initial=0.0)),
        planned=wanted.coverage(planned),
        driven=wanted.coverage(driven),
        achieved=wanted.coverage(worked),
        region_points=surface.kept[wanted.points],
        worked=worked & wanted.accessible,
        wanted=wanted.accessible & wanted.inside_margin,
        force_asked_n=asked,
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
    lines: Sequence[Line],
    program: PathProgram,
    covered: Sequence[np.ndarray],
    why: Sequence[Reachability],
) -> tuple[np.ndarray, ...]:
    driven = [np.zeros(len(line.positions), bool) for line in lines]
    for stroke in program.strokes:
        driven[stroke.line][stroke.first : stroke.last + 1] = True
    made = []
    for does, done, told in zip(driven, covered, why, strict=True):
        verdict = np.full(len(done), "reached", dtype="<U9")
        verdict[done & ~does] = "collision"  # left out: no way there, or it touched something
        verdict[~done & told.regular] = "collision"  # on the ways to and from it
        verdict[~done & ~told.regular] = "singular"
        verdict[~done & ~told.clear] = "collision"
        verdict[~done & ~told.arrives] = "limit"
        made.append(verdict)
    for action in program.actions:
        if action.kind == "process":
            part = made[action.line][action.first : action.first + len(action.timed.slowed)]
            part[action.timed.pace < TOO_SLOW] = "too fast"
    return tuple(made)


def _errors(cell: Cell, lines: Sequence[Line], program: PathProgram) -> tuple[float, float]:
    """The worst distance and angle between planned joints and their waypoints."""
    from nrdf.robot.planning.inverse_kinematics import errors

    away, angle = 0.0, 0.0
    for stroke in program.strokes:
        part = slice(stroke.first, stroke.last + 1)
        line = lines[stroke.line]
        turn = np.full(len(stroke.joints), stroke.turn)
        at, along = cell.to_base(turn, line.positions[part], stroke.axes)
        far, turned = errors(cell.chain.frames(stroke.joints), at, along)
        away, angle = max(away, float(far.max())), max(angle, float(turned.max()))
    return away, angle


def _leans(lines: Sequence[Line], program: PathProgram) -> np.ndarray:
    """Angles (k,), rad, between driven and planned axes of all driven waypoints."""
    leans = [np.zeros(0)]
    for stroke in program.strokes:
        planned = lines[stroke.line].axes[stroke.first : stroke.last + 1]
        cosine = np.einsum("na,na->n", stroke.axes, planned)
        leans.append(np.arctan2(np.linalg.norm(np.cross(stroke.axes, planned), axis=1), cosine))
    return np.concatenate(leans)


def _swept(
    parts: Sequence[tuple[np.ndarray, np.ndarray]], height: float
) -> tuple[np.ndarray, np.ndarray]:
    """The tool's places and axes along waypoints (n, 3) and their axes (n, 3), finely."""
    places: list[np.ndarray] = [np.zeros((0, 3))]
    axes: list[np.ndarray] = [np.zeros((0, 3))]
    for positions, own in parts:
        along = arc_length(positions)
        at = even_arc_lengths(float(along[-1]), _FINE_M)
        place, axis = interpolate(at, along, positions), interpolate(at, along, own)
        places.append(place + height * axis)
        axes.append(axis)
    return np.concatenate(places), np.concatenate(axes)


def _driven(logs: Sequence[Log], height: float) -> tuple[np.ndarray, np.ndarray]:
    """The tool's places and axes where it really worked."""
    places: list[np.ndarray] = [np.zeros((0, 3))]
    axes: list[np.ndarray] = [np.zeros((0, 3))]
    for log in logs:
        asked = log.action.force_n
        works = log.off_m < _ON_PLAN_M if asked is None else log.force_n > _PRESSES * asked
        places.append((log.tip + height * log.axis)[works][::3])
        axes.append(log.axis[works][::3])
    return np.concatenate(places), np.concatenate(axes)
