"""Modifiers: pure functions from tool paths to better ones, used one after another.

Those of paths take `SurfacePath`s in driving order, those of segments `Segment`s, and give a list
of the same; nothing that is given is changed. `MODIFIERS` has all of them by name.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from nrdf.toolpath.modifiers.approach_retract import approach_retract
from nrdf.toolpath.modifiers.chord_error import chord_error, largest_step
from nrdf.toolpath.modifiers.constant_speed import constant_speed
from nrdf.toolpath.modifiers.join import join
from nrdf.toolpath.modifiers.minimum_length import minimum_length
from nrdf.toolpath.modifiers.offset import drag, edge_contact, offset
from nrdf.toolpath.modifiers.one_way import one_way, start_at
from nrdf.toolpath.modifiers.order import order_nearest, order_shortest
from nrdf.toolpath.modifiers.resample import resample
from nrdf.toolpath.modifiers.run_off import run_off
from nrdf.toolpath.modifiers.smooth_orientation import smooth_orientation, steady_normals
from nrdf.toolpath.modifiers.split import split
from nrdf.toolpath.surface_path import SurfacePath
from nrdf.toolpath.types import Segment

PATH_MODIFIERS: dict[str, Callable[..., list[SurfacePath]]] = {
    "split": split,
    "smooth-orientation": smooth_orientation,
    "steady-normals": steady_normals,
    "minimum-length": minimum_length,
    "resample": resample,
    "chord-error": chord_error,
    "largest-step": largest_step,
    "one-way": one_way,
    "start": start_at,
    "order-nearest": order_nearest,
    "order-shortest": order_shortest,
    "run-off": run_off,
    "join": join,
    "drag": drag,
    "offset": offset,
}
"""Each takes paths, then its settings by name."""

SEGMENT_MODIFIERS: dict[str, Callable[..., list[Segment]]] = {
    "edge-contact": edge_contact,
    "constant-speed": constant_speed,
    "approach-retract": approach_retract,
}
"""Each takes process segments, then its settings by name."""

MODIFIERS: dict[str, Callable[..., list[Any]]] = {**PATH_MODIFIERS, **SEGMENT_MODIFIERS}
