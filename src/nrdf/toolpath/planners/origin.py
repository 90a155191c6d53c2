"""Origin of a raster: a place that a line passes through, the others at whole stepovers from it."""

from __future__ import annotations

import numpy as np

from nrdf.surface.fine_mesh import FineMesh

_REACH = 0.95  # of the tool's radius: so far from a part's end its outermost line may be
_INSIDE = 0.02  # of a stepover: a line on the border itself is drawn that far inside it


def extent(values: np.ndarray, weights: np.ndarray, tail: float) -> tuple[float, float]:
    """The least and the largest of values (n,), without that share of the weights (n,) at either
    end."""
    order = np.argsort(values)
    share = np.cumsum(weights[order]) / float(weights.sum())
    low, high = np.interp([tail, 1.0 - tail], share, values[order])
    return float(low), float(high)


def value_at(mesh: FineMesh, values: np.ndarray, place: np.ndarray) -> float:
    """What values (v,) of a mesh's vertices are at a place (3,), m: in the nearest triangle, and as
    they go on from there off the mesh."""
    near = int(np.argmin(np.linalg.norm(mesh.centres - place, axis=1)))
    rise = mesh.slopes(values)[near] @ (place - mesh.centres[near])
    return float(values[mesh.faces[near]].mean() + rise)


def levels_through(
    through: float, low: float, high: float, apart: float, radius_m: float
) -> np.ndarray:
    """Levels (k,), ascending, from `low` to `high` at whole steps `apart` from the level `through`,
    which may lie outside.

    Where an end is farther than the tool reaches from its outermost level, one more lies halfway.
    A part that is too narrow for any has one in its middle.
    """
    first, last = np.ceil((low - through) / apart - 1e-9), np.floor((high - through) / apart + 1e-9)
    levels = through + apart * np.arange(first, last + 1.0)
    if not len(levels):
        return np.array([0.5 * (low + high)])
    reach = max(0.5 * apart, _REACH * min(radius_m, apart))
    before = [0.5 * (low + levels[0])] if levels[0] - low > reach else []
    after = [0.5 * (high + levels[-1])] if high - levels[-1] > reach else []
    inset = min(_INSIDE * apart, 0.5 * (high - low))
    return np.clip(np.concatenate([before, levels, after]), low + inset, high - inset)
