"""Removal: the depth that a sanding or polishing pad takes off every cell of a surface.

Preston's law ("The theory and design of plate glass polishing machines", 1927): depth a second is
k * pressure * speed of the abrasive over the surface. The pressure is that of an elastic foundation
(Winkler): a pad of stiffness K, pressed flat on the surface by a force, presses with K times its
depth there, nowhere below 0. So on a convex bend, or over an edge, fewer cells carry the force, and
more is taken off them. Not modelled: a pad that tilts by itself, wear and clogging of the grit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix
from scipy.spatial import cKDTree

from nrdf.errors import ProcessError
from nrdf.process_model.cells import Cells
from nrdf.process_model.moves import ToolSamples

_FACING = 0.1  # least cosine between a cell's normal and the pad's axis
_RANGES = {
    "radius_m": (1e-4, 0.5), "stiffness_n_m3": (1e3, 1e12), "preston_per_pa": (1e-16, 1e-4),
    "force_n": (1e-3, 1e4),
}  # fmt: skip


@dataclass(frozen=True)
class Pad:
    """A round pad with abrasive on it.

    radius_m: of its face. stiffness_n_m3: pressure for each metre that it is pressed in.
    preston_per_pa: depth for each pascal and metre of sliding: of grit and material. spindle_rad_s:
    how fast it turns, or orbits; orbit_m: radius of the orbit that all of it moves on, 0 for a disc
    that spins about its own axis. force_n: along the tool's axis. Raises ProcessError for values
    that no pad has, naming them.
    """

    radius_m: float
    stiffness_n_m3: float
    preston_per_pa: float
    force_n: float
    spindle_rad_s: float = 0.0
    orbit_m: float = 0.0

    def __post_init__(self) -> None:
        for name, (least, most) in _RANGES.items():
            value = getattr(self, name)
            if not least <= value <= most:
                raise ProcessError(f"a pad with {name} of {value:g}; give {least:g} to {most:g}")
        for name in ("spindle_rad_s", "orbit_m"):
            if not 0.0 <= getattr(self, name) < 1e6:
                raise ProcessError(f"a pad with {name} of {getattr(self, name):g}; give 0 or more")


def removal(
    cells: Cells,
    samples: ToolSamples,
    columns: int,
    pad: Pad,
    feed_m_s: np.ndarray | float,
    force_n: np.ndarray | None = None,
) -> csr_matrix:
    """Depth of each cell for each move: a matrix (n, columns).

    For moves its unit is m², depth (m) for each slowness (s/m); for stops m, the depth itself.
    feed_m_s: of the samples (k,) or of all, 0 for stops: it adds to the speed of the abrasive.
    force_n: of the samples (k,), the pad's own unless given.
    """
    shape = (len(cells.centres), columns)
    if not len(samples.places):
        return csr_matrix(shape)
    cell_m = float(np.sqrt(np.median(cells.areas_m2)))
    reach = np.hypot(pad.radius_m + cell_m, 2.0 * pad.radius_m)
    near = cKDTree(samples.places).query_ball_tree(cKDTree(cells.centres), reach)
    counts = np.array([len(found) for found in near])
    cell = np.fromiter((index for found in near for index in found), np.int64, counts.sum())
    sample = np.repeat(np.arange(len(counts)), counts)
    axes = samples.axes[sample]
    away = cells.centres[cell] - samples.places[sample]
    gap = np.einsum("ka,ka->k", away, axes)
    flat = away - gap[:, None] * axes
    off_centre = np.sqrt(np.einsum("ka,ka->k", flat, flat))
    carried = -np.einsum("ka,ka->k", cells.normals[cell], axes)
    # A cell on the rim counts as far as it is under the pad.
    share = np.clip((pad.radius_m - off_centre) / cell_m + 0.5, 0.0, 1.0)
    under = (share > 0.0) & (carried > _FACING)
    cell, sample, gap, flat = cell[under], sample[under], gap[under], flat[under]
    off_centre, carried, share = off_centre[under], carried[under], share[under]
    area = share * carried * cells.areas_m2[cell]
    force = np.full(len(samples.places), pad.force_n) if force_n is None else force_n
    pressure = winkler_pressure(sample, gap, area, force[sample], pad.stiffness_n_m3)
    feeds = np.broadcast_to(np.asarray(feed_m_s, float), (len(samples.places),))[sample]
    turned = np.cross(samples.axes[sample], flat)
    ahead = np.einsum("ka,ka->k", turned, samples.along[sample])
    speed = sliding_speed(pad, off_centre, ahead, feeds)
    values = pad.preston_per_pa * pressure * share * speed * samples.weights[sample]
    return csr_matrix((values, (cell, samples.column[sample])), shape)


def sliding_speed(
    pad: Pad, off_centre_m: np.ndarray, ahead_m: np.ndarray, feed_m_s: np.ndarray
) -> np.ndarray:
    """Mean speed (k,), m/s, of the abrasive over places (k,), under a pad that moves on.

    off_centre_m: (k,) from the pad's axis; ahead_m: (k,) how far the spin leads along the travel.
    """
    if pad.orbit_m > 0.0:
        # Over an orbit the feed adds and takes away: the mean of |u + v|, to second order.
        orbit = pad.spindle_rad_s * pad.orbit_m
        larger, smaller = np.maximum(orbit, feed_m_s), np.minimum(orbit, feed_m_s)
        return np.asarray(larger + smaller**2 / (4.0 * np.maximum(larger, 1e-12)))
    around = pad.spindle_rad_s * off_centre_m
    squared = around**2 + feed_m_s**2 + 2.0 * pad.spindle_rad_s * ahead_m * feed_m_s
    return np.asarray(np.sqrt(np.maximum(squared, 0.0)))


def winkler_pressure(
    sample: np.ndarray,
    gap_m: np.ndarray,
    area_m2: np.ndarray,
    force_n: np.ndarray | float,
    stiffness: float,
) -> np.ndarray:
    """Pressure (k,), Pa, under a pad at each sample.

    sample: (k,) which; gap_m: (k,) how far along the pad's axis a cell lies from its plane;
    area_m2: (k,) of the cell, square to the axis. The pad sinks until all carry `force_n`, one
    for all or (k,) that of each one's sample.
    """
    if not len(sample):
        return np.zeros(0)
    order = np.lexsort((gap_m, sample))
    group, gap, area = sample[order], gap_m[order], area_m2[order]
    force = np.broadcast_to(np.asarray(force_n, float), (len(sample),))[order]
    start = np.flatnonzero(np.concatenate([[True], group[1:] != group[:-1]]))
    count = np.diff(np.append(start, len(group)))
    number = np.repeat(np.arange(len(start)), count)
    # Within a group gaps count from its first: sums of large numbers would lose digits.
    rise = gap - np.repeat(gap[start], count)
    before, lost = (_sums_before(values, start, count) for values in (area, area * rise))
    touched = stiffness * (rise * before - lost) < force
    wide = np.bincount(number, area * touched, len(start))
    moment = np.bincount(number, area * rise * touched, len(start))
    depth = (force[start] / stiffness + moment) / np.maximum(wide, 1e-300)
    pressure = np.zeros(len(group))
    pressure[order] = stiffness * np.maximum(depth[number] - rise, 0.0) * touched
    return pressure


def _sums_before(values: np.ndarray, start: np.ndarray, count: np.ndarray) -> np.ndarray:
    """Sums of all values of a group that stand before each."""
    total = np.cumsum(values) - values
    return np.asarray(total - np.repeat(total[start], count))
