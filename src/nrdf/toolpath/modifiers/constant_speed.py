"""Constant speed: the feed is that of a tool's contact, not of the point that the robot drives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from nrdf.geometry.polylines import step_lengths
from nrdf.toolpath.types import Segment

FASTEST = 3.0
"""Times the feed that a tool centre point is driven at, at most."""
_SAME = 1e-3
"""Share by which feeds differ that are one."""


def constant_speed(
    segments: Sequence[Segment], contacts: Sequence[np.ndarray], fastest: float = FASTEST
) -> list[Segment]:
    """Segments that are driven so fast that their contacts move along the surface at the feed.

    contacts: (n, 3), m, of each segment's waypoints. A tool that stands off, or touches with its
    edge, goes a longer way around an outer bend than its contact, and a shorter one in an inner
    bend: every waypoint gets the feed of the way to it. The tool centre point is driven at no more
    than `fastest` times the feed, and no less than the feed divided by that. A segment on which
    that is one feed all along keeps one.
    """
    made = []
    for segment, places in zip(segments, contacts, strict=True):
        feeds = segment.feed_m_s * speed_ratios(segment, places, fastest)
        way = step_lengths(segment.positions)
        if len(feeds) < 2 or not way.any():
            made.append(segment)
            continue
        mean = float(way.sum() / (way / feeds[1:]).sum())
        one = bool((np.abs(feeds / mean - 1.0) < _SAME).all())
        made.append(replace(segment, feed_m_s=mean, feeds_m_s=None if one else feeds))
    return made


def speed_ratios(segment: Segment, contacts: np.ndarray, fastest: float = FASTEST) -> np.ndarray:
    """How many times (n,) as fast as its contacts (n, 3), m, a segment's tool centre point moves on
    the way to each waypoint; the first as the second.

    Between 1 / `fastest` and `fastest`; 1 where neither moves.
    """
    if len(contacts) < 2:
        return np.ones(len(contacts))
    worked, way = step_lengths(contacts), step_lengths(segment.positions)
    still = (worked <= 0.0) & (way <= 0.0)
    ratio = np.where(still, 1.0, way / np.maximum(worked, 1e-12))
    ratio = np.clip(ratio, 1.0 / fastest, fastest)
    return np.append(ratio[:1], ratio)
