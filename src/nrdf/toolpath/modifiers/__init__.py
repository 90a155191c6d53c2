"""Modifiers: pure functions from paths on a surface to better ones, used one after another.

Lists of `SurfacePath` come in, in driving order, and go out; nothing that is given is changed.
`MODIFIERS` has them by name.
"""

from __future__ import annotations

from collections.abc import Callable

from nrdf.toolpath.modifiers.join import join
from nrdf.toolpath.modifiers.minimum_length import minimum_length
from nrdf.toolpath.modifiers.order import order_nearest
from nrdf.toolpath.modifiers.resample import resample
from nrdf.toolpath.modifiers.smooth_orientation import smooth_orientation
from nrdf.toolpath.modifiers.split import split
from nrdf.toolpath.surface_path import SurfacePath

MODIFIERS: dict[str, Callable[..., list[SurfacePath]]] = {
    "split": split,
    "smooth-orientation": smooth_orientation,
    "join": join,
    "order": order_nearest,
    "minimum-length": minimum_length,
    "resample": resample,
}
"""Each takes the paths, then its settings by name."""
