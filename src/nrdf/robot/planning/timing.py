"""Time parameterization: joint paths at their feeds, within the joints' limits."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from nrdf.robot.model.kinematics import Chain

STEP_S = 0.004
"""Time step of the simulation and of the arm's control."""
FREE_SHARE = 0.9
"""Share of the joints' speed limits that free moves use."""
_ACCELERATION_S = 0.25  # in which a joint reaches its speed limit
_SAMPLES = 4  # between two waypoints, at which limits are checked


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
    their limits. share: of the joints' speeds that is used. A smooth curve through all joints is
    followed, whose speed is limited forwards and backwards (Bobrow et al., 1985, with each joint's
    acceleration limit split between its two terms).
    """
    count = len(joints)
    if count == 1 or np.abs(np.diff(joints, axis=0)).max() < 1e-9:
        still = np.repeat(joints[:1], 2, axis=0)
        return TimedTrajectory(still, 0.0 * still, np.array([0.0, count - 1.0]), np.ones(count))
    limits = share * chain.speeds
    needed = (np.abs(np.diff(joints, axis=0)) / limits).max(axis=1)
    kept = np.minimum(seconds / np.maximum(needed, 1e-9), 1.0)
    feed_share = np.minimum(np.append(kept, 1.0), np.append(1.0, kept))
    nominal = np.maximum(np.maximum(seconds, needed), 1e-4)
    knots = np.concatenate([[0.0], np.cumsum(nominal)])
    curve = PchipInterpolator(knots, joints, axis=0)
    fine = np.concatenate(
        [np.linspace(a, b, _SAMPLES, endpoint=False) for a, b in itertools.pairwise(knots)]
        + [knots[-1:]]
    )
    first, second = curve(fine, 1), curve(fine, 2)
    pace = _paces(fine, first, second, limits, chain.speeds / _ACCELERATION_S)
    gaps = np.diff(fine)
    took = 2.0 * gaps / np.maximum(pace[:-1] + pace[1:], 1e-6)
    clock = np.concatenate([[0.0], np.cumsum(took)])
    steps = np.arange(int(np.ceil(clock[-1] / STEP_S)) + 1) * STEP_S
    at = np.interp(steps, clock, fine)
    rate = np.interp(steps, clock, pace)
    return TimedTrajectory(
        joints=curve(at),
        speeds=curve(at, 1) * rate[:, None],
        waypoint=np.interp(at, knots, np.arange(count)),
        feed_share=feed_share,
    )


def _paces(
    fine: np.ndarray,
    first: np.ndarray,
    second: np.ndarray,
    limits: np.ndarray,
    accelerations: np.ndarray,
) -> np.ndarray:
    """The speed (m,) along a curve at its parameters `fine` (m,), 1 where it is at its feed."""
    with np.errstate(divide="ignore"):
        most = np.minimum(1.0, (limits / np.abs(first)).min(axis=1))
        bend = np.sqrt((0.5 * accelerations / np.abs(second)).min(axis=1))
        push = np.minimum((0.5 * accelerations / np.abs(first)).min(axis=1), 50.0)
    pace = np.minimum(most, bend)
    pace[0] = pace[-1] = 0.0
    for i in range(1, len(fine)):
        gap = fine[i] - fine[i - 1]
        pace[i] = min(pace[i], np.sqrt(pace[i - 1] ** 2 + 2.0 * push[i - 1] * gap))
    for i in range(len(fine) - 2, -1, -1):
        gap = fine[i + 1] - fine[i]
        pace[i] = min(pace[i], np.sqrt(pace[i + 1] ** 2 + 2.0 * push[i + 1] * gap))
    return np.asarray(pace)
