"""Which places of a region a tool has room in front of."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from nrdf.errors import ProcessError
from nrdf.process.surface import Surface
from nrdf.units import in_words

_STEP_M, _MOST_STEPS = 0.005, 200
_INSIDE = 0.5  # winding number
_NEIGHBOURS = 6


def with_room(surface: Surface, region: np.ndarray, clearance_m: float) -> np.ndarray:
    """The points of a region, indices (k,) of the surface's cloud, with nothing close before them.

    Along its normal, up to `clearance_m` away, a point must meet only what is outside of the
    object: in a crevice between two parts, or beneath a part that lies on another, it does not.
    Raises ProcessError where that leaves nothing.
    """
    if clearance_m <= 0.0:
        return region
    inside = surface.indices(region)
    # Beyond the object nothing stands.
    far = min(clearance_m, float(np.linalg.norm(np.ptp(surface.points, axis=0))))
    heights = np.linspace(0.0, far, int(np.clip(far / _STEP_M, 1, _MOST_STEPS)) + 1)[1:]
    before = surface.points[inside, None] + heights[:, None] * surface.normals[inside, None]
    wound = surface.winding(before.reshape(-1, 3)).reshape(len(inside), -1)
    blocked = np.asarray((wound > _INSIDE).any(axis=1))
    # A sum of many points fails here and there: a point alone is no crevice.
    places = surface.points[inside]
    near = cKDTree(places).query(places, np.arange(min(_NEIGHBOURS, len(inside))) + 1)[1]
    free = inside[~blocked | (blocked[near].sum(axis=1) == 1)]
    if not len(free):
        raise ProcessError(
            f"the tool's clearance_m is {clearance_m:g}, and nowhere in the region are "
            f"{in_words('clearance_m', clearance_m)} free before the surface; give less, or 0"
        )
    return surface.kept[free]
