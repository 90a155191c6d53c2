"""Strokes: lines, or pieces of them, as the arm drives them, and the ways to and from them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from nrdf.geometry.polylines import interpolate, step_lengths
from nrdf.robot.model.cell import Cell
from nrdf.robot.planning.inverse_kinematics import LEAST_CLEARANCE_M, solve
from nrdf.robot.planning.lines import Line
from nrdf.robot.planning.step import advance_along, leaned

_RETREAT_STEP_M, _RETREAT_STEPS = 0.012, 16
_FINE_M, _FINE_RAD = 0.004, np.radians(3.0)  # between places on a line
_BETWEEN_M = 0.5 * LEAST_CLEARANCE_M
"""Clearance between waypoints, where the object may bulge."""
_LEAST_LEAD = 2  # steps that the tool must be able to leave the surface by
_ASLANT_RAD, _ASLANT_WAYS = np.radians(45.0), 6


@dataclass(frozen=True)
class Piece:
    """A line, or a piece of it, that the arm can follow at one turn of the object.

    line: index of it; first, last: of its waypoints, inclusive. axes: (m, 3) of the tool there, in
    the object's frame, the planned ones unless it leans; joints: (m, n).
    """

    line: int
    first: int
    last: int
    turn: int
    axes: np.ndarray
    joints: np.ndarray


@dataclass(frozen=True)
class Stroke(Piece):
    """A piece as the arm drives it, with its ways to and from the surface.

    way: (k, n) joints along the line, with places between the waypoints; at: (k,) the waypoint each
    is at, a number between 0 and m - 1. lead_in (j, n), lead_out (j, n): on the ways to and from.
    """

    way: np.ndarray
    at: np.ndarray
    lead_in: np.ndarray
    lead_out: np.ndarray

    def whole(self) -> np.ndarray:
        return np.concatenate([self.lead_in, self.way, self.lead_out])

    def wound(self, shift: np.ndarray) -> Stroke:
        """The same with its joints shifted by (n,)."""
        return replace(
            self,
            joints=self.joints + shift,
            way=self.way + shift,
            lead_in=self.lead_in + shift,
            lead_out=self.lead_out + shift,
        )


def between(
    cell: Cell, lines: Sequence[Line], pieces: Sequence[Piece]
) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """For each piece its joints (k, n) with places in between that are on the line too; the
    waypoint (k,) that each is at; and after which waypoints (m - 1,) something is in the way.

    Between waypoints, joints that move evenly would take the tool off the straight line.
    """
    numbers, guesses, places, axes = [], [], [], []
    for piece in pieces:
        positions = lines[piece.line].positions[piece.first : piece.last + 1]
        number = _numbers(positions, piece.axes)
        along = _interpolated(number, piece.axes)
        numbers.append(number)
        guesses.append(_interpolated(number, piece.joints))
        places.append(_interpolated(number, positions))
        axes.append(along / np.linalg.norm(along, axis=1, keepdims=True))
    sizes = [len(number) for number in numbers]
    turn = np.repeat([piece.turn for piece in pieces], sizes)
    at, along = cell.to_base(turn, np.concatenate(places), np.concatenate(axes))
    joints, good = solve(cell.chain, np.concatenate(guesses), at, along, 8)
    frames = cell.chain.frames(joints)
    good &= cell.clearance(frames, turn).least > _BETWEEN_M
    good &= cell.own_clearance(frames) > _BETWEEN_M
    cuts = np.cumsum(sizes)[:-1]
    made = []
    for piece, number, way, fine in zip(
        pieces, numbers, np.split(joints, cuts), np.split(good, cuts), strict=True
    ):
        blocked = np.zeros(max(piece.last - piece.first, 0), bool)
        # A place at a waypoint itself is the waypoint's, whose joints are known to be good.
        wrong = ~fine & (number % 1.0 > 0.0)
        blocked[np.floor(number[wrong]).astype(int)] = True
        own = number % 1.0 == 0.0
        way[own] = piece.joints
        made.append((way, number, blocked))
    return made


def _numbers(positions: np.ndarray, axes: np.ndarray) -> np.ndarray:
    if len(positions) == 1:
        return np.zeros(1)
    moved, turned = step_lengths(positions), step_lengths(axes)
    counts = np.ceil(np.maximum(moved / _FINE_M, turned / _FINE_RAD)).astype(int).clip(1, 80)
    steps = [k + np.arange(count) / count for k, count in enumerate(counts)]
    return np.append(np.concatenate(steps), len(positions) - 1.0)


def _interpolated(number: np.ndarray, values: np.ndarray) -> np.ndarray:
    return interpolate(number, np.arange(len(values)), values)


def add_approach_retract(
    cell: Cell,
    lines: Sequence[Line],
    pieces: Sequence[Piece],
    ways: Sequence[tuple[np.ndarray, np.ndarray]],
) -> list[Stroke | None]:
    """Strokes with the ways to and from them; None where the tool cannot leave the surface.

    ways: of each piece, joints and numbers that `between` found. The tool leaves as the line says,
    or else straight along its axis, or else aslant.
    """
    ends = [(i, begins) for i in range(len(pieces)) for begins in (True, False)]
    found: dict[tuple[int, bool], np.ndarray] = {}
    for attempt in range(2 + _ASLANT_WAYS):
        open_ = [end for end in ends if end not in found]
        if not open_:
            break
        turns, joints, places, axes = [], [], [], []
        for i, begins in open_:
            piece = pieces[i]
            index = 0 if begins else -1
            waypoint = piece.first if begins else piece.last
            turns.append(piece.turn)
            joints.append(piece.joints[index])
            axes.append(piece.axes[index])
            places.append(_lead(lines[piece.line], waypoint, begins, piece.axes[index], attempt))
        driven = advance_along(cell, np.array(turns), np.array(joints), places, np.array(axes))
        for end, way, wanted in zip(open_, driven, places, strict=True):
            if len(way) >= min(len(wanted), _LEAST_LEAD):
                found[end] = way
    made: list[Stroke | None] = []
    for i, (piece, (way, at)) in enumerate(zip(pieces, ways, strict=True)):
        if (i, True) not in found or (i, False) not in found:
            made.append(None)
            continue
        made.append(
            Stroke(
                piece.line, piece.first, piece.last, piece.turn, piece.axes, piece.joints, way, at,
                found[i, True][::-1], found[i, False],
            )
        )  # fmt: skip
    return made


def _lead(line: Line, waypoint: int, begins: bool, axis: np.ndarray, attempt: int) -> np.ndarray:
    """Places (k, 3) by which the tool leaves a waypoint, outwards, as tried in turn."""
    if attempt == 0:
        into, out = line.leads(waypoint, waypoint)
        return into[::-1] if begins else out
    away = -axis
    if attempt > 1:
        away = leaned(axis[None], np.pi - _ASLANT_RAD, _ASLANT_WAYS)[0, attempt - 2]
    return line.straight_away(waypoint, away)


def retreat(cell: Cell, stroke: Stroke, start: bool) -> Stroke:
    """A stroke whose way in (or out) begins (ends) farther from the surface, as far as is clear."""
    whole = stroke.whole()
    joints = whole[0] if start else whole[-1]
    axis = stroke.axes[0 if start else -1]
    turn = np.array([stroke.turn])
    pose = cell.poses[stroke.turn]
    tip = cell.chain.frames(joints[None]).tcp[0]
    tip = (tip - pose[:3, 3]) @ pose[:3, :3]
    way = tip - _RETREAT_STEP_M * np.arange(1, _RETREAT_STEPS + 1)[:, None] * axis
    driven = advance_along(cell, turn, joints[None], [way], axis[None])[0]
    if start:
        return replace(stroke, lead_in=np.concatenate([driven[::-1], stroke.lead_in]))
    return replace(stroke, lead_out=np.concatenate([stroke.lead_out, driven]))
