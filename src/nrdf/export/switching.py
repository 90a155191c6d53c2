"""What a cell's tools switch, as lines of a controller's own language."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from nrdf.cell.tools import CellTool, Switch, SwitchedFormat
from nrdf.export.header import revolutions_per_minute
from nrdf.export.names import number, plain_text
from nrdf.export.options import Options
from nrdf.geometry.frames import unit_vectors
from nrdf.toolpath.types import Segment, ToolPath

_SAME_M, _STRAIGHT = 1e-9, 0.95  # cosine between steps of a way that goes on


@dataclass(frozen=True)
class Dialect:
    """How a format writes an output, by its signal and state, and a wait in seconds. in_passing:
    whether its outputs can change while the robot passes a waypoint."""

    name: SwitchedFormat
    output: Callable[[str, bool], str]
    wait: Callable[[float], str]
    in_passing: bool = False


@dataclass(frozen=True)
class Switching:
    """The lines around one path and its segments.

    stops: indices of segments after which the robot must arrive, since something is switched there.
    passing: by the index of a segment, the signal and state of an output that changes as the robot
    passes its last waypoint, at speed.
    """

    path: ToolPath
    switches: tuple[Switch, ...]
    dialect: Dialect
    stops: frozenset[int]
    passing: Mapping[int, tuple[str, bool]]

    def before(self, index: int) -> list[str]:
        """Before the segment `index` is driven: what begins with it."""
        return [
            line
            for switch in self.switches
            if index in _begins(switch, self.path) and index - 1 not in self.passing
            for line in self._lines(switch, self.path.segments[index], True)
        ]

    def after(self, index: int) -> list[str]:
        """After the segment `index`: what ends with it, the last that was switched on first."""
        return [
            line
            for switch in reversed(self.switches)
            if index in _ends(switch, self.path) and index not in self.passing
            for line in self._lines(switch, self.path.segments[index], False)
        ]

    def _lines(self, switch: Switch, segment: Segment, on: bool) -> list[str]:
        name = self.dialect.name
        lines = []
        if name in switch.outputs:
            lines.append(self.dialect.output(switch.outputs[name], on))  # type: ignore[index]
        values = {
            "{rpm}": number(revolutions_per_minute(self.path.spindle_rad_s or 0.0), 1),
            "{force_n}": number(segment.force_n or 0.0, 3),
            "{feed_mm_s}": number(1000 * segment.feed_m_s, 3),
        }
        for line in (switch.on if on else switch.off).get(name, []):
            for word, value in values.items():
                line = line.replace(word, value)
            lines.append(line)
        wait = switch.wait_on_s if on else switch.wait_off_s
        return [*lines, self.dialect.wait(wait)] if wait else lines


def switching(path: ToolPath, options: Options, dialect: Dialect) -> Switching:
    """What is switched along a path, by its tool and the kind of its process, in one language."""
    tool = cell_tool(path, options)
    switches = [] if tool is None else [s for s in tool.switches if _concerns(s, path)]
    switches = [switch for switch in switches if switch.switches(dialect.name)]
    places = [(i - 1, switch, True) for switch in switches for i in _begins(switch, path)]
    places += [(i, switch, False) for switch in switches for i in _ends(switch, path)]
    stops = [i for i, _, _ in places]
    passing = {
        i: (switch.outputs[dialect.name], on)  # type: ignore[index]
        for i, switch, on in places
        if dialect.in_passing and stops.count(i) == 1 and _goes_on(path, i)
        and dialect.name not in switch.on and not (switch.wait_on_s if on else switch.wait_off_s)
    }  # fmt: skip
    return Switching(path, tuple(switches), dialect, frozenset({*stops} - {*passing}), passing)


def _goes_on(path: ToolPath, index: int) -> bool:
    """Whether the way goes on straight from a segment to the next one."""
    if not 0 <= index < len(path.segments) - 1:
        return False
    segment, after = path.segments[index], path.segments[index + 1]
    places = np.concatenate([segment.positions[-2:], after.positions[:2]])
    steps = np.diff(places, axis=0)
    steps = unit_vectors(steps[np.linalg.norm(steps, axis=1) > _SAME_M])
    return len(steps) > 1 and bool((steps[1:] @ steps[0] > _STRAIGHT).all())


def cell_tool(path: ToolPath, options: Options) -> CellTool | None:
    """The cell's tool of a path; None without a cell."""
    if options.cell is None:
        return None
    return next((tool for tool in options.cell.tools if tool.name == path.tool), None)


def switching_note(paths: tuple[ToolPath, ...], options: Options, dialect: Dialect) -> str:
    """A sentence for the header: which tools are switched; "" without a cell."""
    if options.cell is None:
        return ""
    switched = {p.tool: None for p in paths if switching(p, options, dialect).switches}
    others = {p.tool: None for p in paths if p.tool not in switched}
    lines = [f"Cell: {plain_text(options.cell.name)}."]
    if switched:
        lines.append(f"Switched by the program: {', '.join(map(plain_text, switched))}.")
    if others:
        lines.append(f"Not switched by the program: {', '.join(map(plain_text, others))}.")
    return " ".join(lines)


def _concerns(switch: Switch, path: ToolPath) -> bool:
    return not switch.kinds or path.process_kind in (None, *switch.kinds)


def _is_on(switch: Switch, segment: Segment) -> bool:
    if switch.during == "path":
        return True
    if switch.during == "contact":
        return segment.force_n is not None
    return segment.kind == "process"


def _runs(switch: Switch, path: ToolPath) -> list[tuple[int, int]]:
    """First and last segment of each run during which it is on."""
    runs: list[tuple[int, int]] = []
    for i, segment in enumerate(path.segments):
        if not _is_on(switch, segment):
            continue
        # Where the force changes, a force control is told the new one.
        before = path.segments[max(i - 1, 0)].force_n
        changed = switch.during == "contact" and before != segment.force_n
        if runs and runs[-1][1] == i - 1 and not changed:
            runs[-1] = (runs[-1][0], i)
        else:
            runs.append((i, i))
    return runs


def _begins(switch: Switch, path: ToolPath) -> set[int]:
    return {first for first, _ in _runs(switch, path)}


def _ends(switch: Switch, path: ToolPath) -> set[int]:
    return {last for _, last in _runs(switch, path)}
