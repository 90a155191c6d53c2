"""Which places of a region a tool has room in front of."""

from __future__ import annotations

import numpy as np

from nrdf.errors import ProcessError
from nrdf.process.surface import Surface
from nrdf.units import in_words

_STEP_M = 0.005
_INSIDE = 0.5  # winding number


def with_room(surface: Surface, region: np.ndarray, clearance_m: float) -> np.ndarray:
    """The points of a region, indices (k,) of the surface's cloud, with nothing close before them.

    Along its normal, up to `clearance_m` away, a point must meet only what is outside of the
    object: in a crevice between two parts, or beneath a part that lies on another, it does not.
    Raises ProcessError where that leaves nothing.
    """
    if clearance_m <= 0.0:
        return region
    inside = surface.indices(region)
    heights = np.linspace(0.0, clearance_m, max(int(np.ceil(clearance_m / _STEP_M)), 1) + 1)[1:]
    before = surface.points[inside, None] + heights[:, None] * surface.normals[inside, None]
    wound = surface.winding(before.reshape(-1, 3)).reshape(len(inside), -1)
    free = inside[(wound < _INSIDE).all(axis=1)]
    if not len(free):
        raise ProcessError(
            f"the tool's clearance_m is {clearance_m:g}, and nowhere in the region are "
            f"{in_words('clearance_m', clearance_m)} free before the surface; give less, or 0"
        )
    return surface.kept[free]
