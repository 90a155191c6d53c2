"""What a tool does where the arm is slower than its feed: a gun waits, a pad presses less."""

from __future__ import annotations

import numpy as np

from nrdf.robot.model.cell import Cell
from nrdf.robot.planning.timing import STEP_S
from nrdf.toolpath.types import Segment

LEAST_FORCE_SHARE = 0.1
"""Share of its force with which a pad that stands still rests on the surface."""
_AT_FEED = 0.95  # share of a feed with which it counts as reached


def feed_share(cell: Cell, process: Segment, joints: np.ndarray, at: np.ndarray) -> np.ndarray:
    """The share (t,) of its planned feed that the tool has, at joints (t, n) of every step and
    waypoints `at` (t,), numbers between the segment's."""
    tips = cell.chain.frames(joints).tcp
    speeds = np.linalg.norm(np.gradient(tips, STEP_S, axis=0), axis=1)
    number = np.arange(len(process.positions))
    return np.asarray(speeds / np.interp(at + 0.5, number, process.speeds_m_s))


def force_share(process: Segment, share: np.ndarray) -> np.ndarray | None:
    """The share (t,) of its force with which a pad presses, where feeds were planned by the result:
    that of its feed which it has, so that it takes off as much everywhere."""
    if process.force_n is None or process.feeds_m_s is None:
        return None
    return np.clip(share, LEAST_FORCE_SHARE, 1.0)


def gun_waits(share: np.ndarray, on: np.ndarray) -> np.ndarray:
    """Where (t,) a gun that would be on (t,) is kept off, at the ends of a joint path: for as long
    as the arm takes more time there than its feed has. share: (t,) of that feed.

    From rest to its feed an arm takes twice the time, and so leaves twice the film. The gun goes on
    after half of that, and leaves as much as it should: its fan is wide to the way that is missed.
    """
    off = np.zeros(len(on), bool)
    for side in (1, -1):
        own = np.flatnonzero(on[::side])
        own = own[: (len(own) + 1) // 2]
        slow = share[::side][own]
        fast = np.flatnonzero(slow > _AT_FEED)
        slow = slow[: fast[0] if len(fast) else None]
        off[::side][own[: round(float((1.0 - slow).clip(0.0).sum()))]] = True
    return off
