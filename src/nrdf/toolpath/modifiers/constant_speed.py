"""Constant speed: the feed is that of a tool's contact, not of the point that the robot drives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from nrdf.geometry.polylines import total_length
from nrdf.toolpath.types import Segment

FASTEST = 3.0
"""Times the feed that a tool centre point is driven at, at most."""


def constant_speed(
    segments: Sequence[Segment], contacts: Sequence[np.ndarray], fastest: float = FASTEST
) -> list[Segment]:
    """Segments that are driven so fast that their contacts move along the surface at the feed.

    contacts: (n, 3), m, of each segment's waypoints. A tool that stands off, or touches with its
    edge, goes a longer way around an outer bend than its contact, and a shorter one in an inner
    bend. A segment has one feed: what it keeps is the time that its contact should take as a
    whole. The tool centre point is driven at no more than `fastest` times the feed, and no less
    than the feed divided by that.
    """
    return [
        replace(segment, feed_m_s=speed_ratio(segment, places, fastest) * segment.feed_m_s)
        for segment, places in zip(segments, contacts, strict=True)
    ]


def speed_ratio(segment: Segment, contacts: np.ndarray, fastest: float = FASTEST) -> float:
    """How many times as fast as its contacts (n, 3), m, a segment's tool centre point moves.

    Between 1 / `fastest` and `fastest`; 1 where either of them does not move at all.
    """
    worked, way = total_length(contacts), total_length(segment.positions)
    if worked <= 0.0 or way <= 0.0:
        return 1.0
    return float(np.clip(way / worked, 1.0 / fastest, fastest))
