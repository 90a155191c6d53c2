"""Deposition: the film that a spray lays on every cell of a surface.

A gun is a point source: what its profile sends through a plate at the stand-off goes on along
straight rays. On a cell at height h before the gun, seen at an angle, the film a second is

    flux(u, w) * (standoff / h)² * cos(angle to the cell's normal) / cos(angle to the gun's axis)

where u, w are the ray's places on the plate (solid angles are kept: Conner et al., "Paint
deposition modeling for trajectory planning on automotive surfaces", 2005). What something else
hides gets nothing. Not modelled: drift, rebound, electrostatic pull around edges, runs, drying.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix
from scipy.spatial import cKDTree

from nrdf.process_model.cells import Cells
from nrdf.process_model.moves import ToolSamples
from nrdf.process_model.spray_profile import SprayProfile
from nrdf.surface.target_mesh import TargetMesh

_BESIDE = 1.3  # half-widths, from the place that the gun points at, within which cells are reached
_NEAREST = 0.2  # stand-offs
_SHADOW_STEPS = 3.0  # along a fan's half-width: places from which shadows are looked for
_BEFORE = 1e-4  # share of a ray's length before its cell, where it counts as arrived
_AT_ONCE = 400_000


def deposition(
    cells: Cells, samples: ToolSamples, columns: int, profile: SprayProfile, blocking: TargetMesh
) -> csr_matrix:
    """Film of each cell for each move: a matrix (n, columns).

    For moves its unit is m², film (m) for each slowness (s/m); for stops m, the film itself.
    blocking: what may stand between gun and cell.
    """
    shape = (len(cells.centres), columns)
    if not len(samples.places):
        return csr_matrix(shape)
    aimed = samples.places + profile.standoff_m * samples.axes
    reach = _BESIDE * max(profile.ends_m)
    near = cKDTree(aimed).query_ball_tree(cKDTree(cells.centres), reach)
    counts = np.array([len(found) for found in near])
    cell = np.fromiter((index for found in near for index in found), np.int64, counts.sum())
    sample = np.repeat(np.arange(len(counts)), counts)
    film = np.concatenate(
        [
            _film_rate(cells, samples, profile, cell[part], sample[part])
            for part in _parts(len(cell))
        ]
        or [np.zeros(0)]
    )
    lies = film > 0.0
    cell, sample, film = cell[lies], sample[lies], film[lies]
    film = film * _seen(cells, samples, profile, blocking, cell, sample)
    values = film * samples.weights[sample]
    return csr_matrix((values, (cell, samples.column[sample])), shape)


def _parts(count: int) -> list[slice]:
    return [slice(start, start + _AT_ONCE) for start in range(0, count, _AT_ONCE)]


def _film_rate(
    cells: Cells, samples: ToolSamples, profile: SprayProfile, cell: np.ndarray, sample: np.ndarray
) -> np.ndarray:
    """Film a second (k,), m/s, on cells (k,) from samples (k,) that nothing hides."""
    axes, along = samples.axes[sample], samples.along[sample]
    ray = cells.centres[cell] - samples.places[sample]
    height = np.einsum("ka,ka->k", ray, axes)
    ahead = np.einsum("ka,ka->k", ray, along)
    aside = np.einsum("ka,ka->k", ray, np.cross(axes, along))
    facing = -np.einsum("ka,ka->k", ray, cells.normals[cell])  # cosine times the ray's length
    before = (height > _NEAREST * profile.standoff_m) & (facing > 0.0)
    ratio = profile.standoff_m / np.where(before, height, 1.0)
    # Both cosines have the ray's length below them, which cancels.
    spread = ratio**2 * np.where(before, facing / np.where(before, height, 1.0), 0.0)
    return np.asarray(profile.flux(aside * ratio, ahead * ratio) * spread)


def _seen(
    cells: Cells,
    samples: ToolSamples,
    profile: SprayProfile,
    blocking: TargetMesh,
    cell: np.ndarray,
    sample: np.ndarray,
) -> np.ndarray:
    """How much (k,), 0 or 1, of cells (k,) is seen from samples (k,).

    Asked once for each cell and stretch of the way that is short to the fan.
    """
    if not len(cell):
        return np.zeros(0)
    step = max(min(profile.ends_m), 1e-6) / _SHADOW_STEPS
    moved = np.linalg.norm(np.diff(samples.places, axis=0), axis=1)
    stretch = np.concatenate([[0.0], np.cumsum(np.minimum(moved, step))]) // step
    stretch = np.cumsum(np.concatenate([[0], np.diff(stretch) != 0]))
    first = np.flatnonzero(np.concatenate([[True], np.diff(stretch) != 0]))
    last = np.append(first[1:], len(stretch)) - 1
    middle = (first + last) // 2
    key = cell * (int(stretch[-1]) + 1) + stretch[sample]
    pair, back = np.unique(key, return_inverse=True)
    asked, source = np.divmod(pair, int(stretch[-1]) + 1)
    start = samples.places[middle[source]]
    ray = cells.centres[asked] - start
    length = np.linalg.norm(ray, axis=1)
    hit, _ = blocking.first_hits(start, ray / length[:, None])
    reached = hit >= length * (1.0 - _BEFORE) - 1e-6
    return np.asarray(reached[back.reshape(-1)].astype(float))
