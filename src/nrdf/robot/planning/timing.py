"""Time parameterization: joint paths at their feeds, within the joints' limits."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from nrdf.geometry.polylines import step_lengths, summed
from nrdf.robot.model.kinematics import Chain

STEP_S = 0.004
"""Time step of the simulation and of the arm's control."""
FREE_SHARE = 0.9
"""Share of the joints' speed limits that free moves use."""
_ACCELERATION_S = 0.25  # in which a joint reaches its speed limit
_SAMPLES = 4  # between two waypoints, at which limits are checked
_BEND_SHARE = 0.8  # of a joint's acceleration that bends of the way may need, the rest is for speed
_ROUNDING_M, _OFF_M = 0.012, 0.0005
"""Half-width of the mean that rounds the way's corners, and how far it may lead the tool off it."""
_EVERY_M = 0.001


@dataclass(frozen=True)
class TimedTrajectory:
    """Where the arm is at each step of the simulation.

    joints (t, n), rad, and their speeds (t, n). waypoint (t,): a number between 0 and the last
    waypoint's. feed_share (m,): the share of its feed that the joints' speed limits leave around
    each waypoint.
    """

    joints: np.ndarray
    speeds: np.ndarray
    waypoint: np.ndarray
    feed_share: np.ndarray

    @property
    def slowed(self) -> np.ndarray:
        """Whether (m,) the feed cannot be kept."""
        return self.feed_share < 1.0


def time_parameterize(
    chain: Chain, joints: np.ndarray, seconds: np.ndarray, share: float = 1.0
) -> TimedTrajectory:
    """The trajectory through joints (m, n), from rest to rest.

    seconds: (m - 1,) that each step would take at its feed; more is taken where joints are at
    their limits. share: of the joints' speeds that is used. A smooth curve is followed that rounds
    the way's corners, within a tolerance, as a controller's blends do; its speed is limited
    forwards and backwards (Bobrow et al., 1985).
    """
    count = len(joints)
    still = np.repeat(joints[:1], 2, axis=0)
    if count == 1 or np.abs(np.diff(joints, axis=0)).max() < 1e-9:
        return TimedTrajectory(still, 0.0 * still, np.array([0.0, count - 1.0]), np.ones(count))
    limits = share * chain.speeds
    needed = (np.abs(np.diff(joints, axis=0)) / limits).max(axis=1)
    kept = np.minimum(seconds / np.maximum(needed, 1e-9), 1.0)
    feed_share = np.minimum(np.append(kept, 1.0), np.append(1.0, kept))
    # Along the joints' way, so that a change of the feed is no bend of the curve.
    moved = step_lengths(joints / limits)
    moves = np.append(True, moved > 1e-9)
    knots = summed(moved)[moves]
    curve = CubicSpline(knots, _rounded(chain, joints)[moves], axis=0)
    fine = np.concatenate(
        [np.linspace(a, b, _SAMPLES, endpoint=False) for a, b in itertools.pairwise(knots)]
        + [knots[-1:]]
    )
    wanted = np.diff(knots) / np.maximum(seconds[moves[1:]], 1e-6)
    wanted = np.interp(fine, 0.5 * (knots[1:] + knots[:-1]), wanted)
    pace = _paces(fine, curve(fine, 1), curve(fine, 2), wanted, limits, chain.speeds)
    took = 2.0 * np.diff(fine) / np.maximum(pace[:-1] + pace[1:], 1e-9)
    clock = summed(took)
    steps = np.arange(int(np.ceil(clock[-1] / STEP_S)) + 1) * STEP_S
    at, rate = _at(steps, clock, fine, pace)
    return TimedTrajectory(
        joints=curve(at),
        speeds=curve(at, 1) * rate[:, None],
        waypoint=np.interp(at, knots, np.flatnonzero(moves)),
        feed_share=feed_share,
    )


def _rounded(chain: Chain, joints: np.ndarray) -> np.ndarray:
    """Joints (m, n) averaged along the tool's way, as far as that leads it off its own way by no
    more than the tolerance. The ends stay."""
    tips = chain.frames(joints).tcp
    way = summed(step_lengths(tips) + 1e-9)
    count = int(way[-1] / _EVERY_M)
    half = min(round(_ROUNDING_M / _EVERY_M), count - 1)
    if half < 1 or len(joints) < 3:
        return joints
    even = np.linspace(0.0, way[-1], count + 1)
    fine = np.stack([np.interp(even, way, joint) for joint in joints.T], axis=1)
    # Beyond its ends the way goes on as its mirror image through them: there the mean is the end.
    padded = np.pad(fine, ((half, half), (0, 0)), mode="reflect", reflect_type="odd")
    weights = np.bartlett(2 * half + 1)
    mean = [np.convolve(joint, weights / weights.sum(), "valid") for joint in padded.T]
    round_ = np.stack([np.interp(way, even, joint) for joint in mean], axis=1)
    off = np.linalg.norm(chain.frames(round_).tcp - tips, axis=1)
    share = np.minimum(_OFF_M / np.maximum(off, 1e-12), 1.0)
    return np.asarray(joints + share[:, None] * (round_ - joints))


def _at(
    steps: np.ndarray, clock: np.ndarray, fine: np.ndarray, pace: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Parameter and its pace (t,) at times (t,), with an even acceleration between the parameters
    `fine` (m,), which are passed at `clock` (m,)."""
    k = np.clip(np.searchsorted(clock, steps, side="right") - 1, 0, len(clock) - 2)
    since, whole = steps - clock[k], clock[k + 1] - clock[k]
    since = np.minimum(since, whole)
    gain = (pace[k + 1] - pace[k]) / np.maximum(whole, 1e-12)
    at = fine[k] + pace[k] * since + 0.5 * gain * since**2
    return np.minimum(at, fine[-1]), pace[k] + gain * since


def _paces(
    fine: np.ndarray,
    first: np.ndarray,
    second: np.ndarray,
    wanted: np.ndarray,
    limits: np.ndarray,
    speeds: np.ndarray,
) -> np.ndarray:
    """The speed (m,) along a curve at its parameters `fine` (m,), `wanted` (m,) where joints can.

    first, second: (m, n) derivatives of the curve; limits, speeds: (n,) of the joints, in this move
    and at all.
    """
    first, second = np.maximum(np.abs(first), 1e-9), np.maximum(np.abs(second), 1e-9)
    most = speeds / _ACCELERATION_S
    pace = np.minimum(wanted, (limits / first).min(axis=1))
    pace = np.minimum(pace, np.sqrt((_BEND_SHARE * most / second).min(axis=1)))
    pace[0] = pace[-1] = 0.0
    gaps = np.diff(fine)
    for order, step in ((range(1, len(fine)), 1), (range(len(fine) - 2, -1, -1), -1)):
        for i in order:
            before = i - step
            squared = pace[before] ** 2
            push = ((most - second[before] * squared) / first[before]).min()
            pace[i] = min(pace[i], np.sqrt(squared + 2.0 * push * gaps[min(i, before)]))
    return np.asarray(pace)
