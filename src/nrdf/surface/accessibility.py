"""Which points of a region a tool can access: its clearance is free before the surface there."""

from __future__ import annotations

import numpy as np

from nrdf.errors import ProcessError
from nrdf.geometry.units import readable
from nrdf.geometry.winding import WindingNumber
from nrdf.surface.surface import Surface

_STEP_M, _MOST_STEPS = 0.005, 200
_INSIDE = 0.5  # winding number


def accessible_points(surface: Surface, region: np.ndarray, clearance_m: float) -> np.ndarray:
    """The points of a region, indices (k,) of the surface's points, with nothing close before them.

    Along its normal, up to `clearance_m` away, a point must meet only what is outside of the
    object: in a crevice between two parts, or beneath a part that lies on another, it does not.
    Raises ProcessError where that leaves nothing.
    """
    if clearance_m <= 0.0:
        return region
    key = "blocked", clearance_m
    if key not in surface.found:
        surface.found[key] = _blocked(surface, clearance_m)
    inside = surface.check_region(region)
    free = inside[~surface.found[key][inside]]
    if not len(free):
        raise ProcessError(
            f"the tool's clearance_m is {clearance_m:g}, and nowhere in the region are "
            f"{readable('clearance_m', clearance_m)} free before the surface; give less, or 0"
        )
    return np.asarray(free)


def _blocked(surface: Surface, clearance_m: float) -> np.ndarray:
    """Whether (n,) something stands before each of a surface's points."""
    # Beyond the object nothing stands.
    far = min(clearance_m, float(np.linalg.norm(np.ptp(surface.points, axis=0))))
    heights = np.linspace(0.0, far, int(np.clip(np.ceil(far / _STEP_M), 1, _MOST_STEPS)) + 1)[1:]
    before = surface.points[:, None] + heights[:, None] * surface.normals[:, None]
    winding = WindingNumber(surface.points, surface.normals)
    wound = winding(before.reshape(-1, 3), order=1)
    blocked = np.asarray((wound.reshape(len(before), -1) > _INSIDE).any(axis=1))
    # A sum of many points fails here and there: a point alone is no crevice.
    i, j = surface.edges.T
    beside = np.zeros(len(blocked), bool)
    beside[i[blocked[j]]] = beside[j[blocked[i]]] = True
    return np.asarray(blocked & beside)
