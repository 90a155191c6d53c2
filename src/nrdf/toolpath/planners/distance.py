"""Distances along a mesh: functions whose gradient has length 1, by the heat method and Poisson.

The heat method (Crane, Weischedel, Wardetzky 2013) gives a first distance; rounds of "turn every
gradient to length 1, fit the function to those" (as in Liu et al. 2008) make it even.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_matrix, diags
from scipy.sparse.linalg import SuperLU, splu

from nrdf.surface.fine_mesh import FineMesh
from nrdf.toolpath.planners.level_lines import level_lines

_ROUNDS = 8
_EVEN, _MORE_EVEN = 0.98, 0.005
_LONG_HEAT = 40.0
"""Times steps of the heat that the mesh is across, at most: heat that is too short underflows."""


def distance_from(mesh: FineMesh, seeds: np.ndarray, rounds: int = _ROUNDS) -> np.ndarray:
    """Distance (v,) along the surface from vertices (s,), m; 0 where the mesh hangs not together
    with them."""
    fixed = np.zeros(len(mesh.vertices), bool)
    fixed[seeds] = True
    free = np.flatnonzero(~fixed)
    values = np.zeros(len(mesh.vertices))
    if not len(free):
        return values
    heat = _heat(mesh)
    start = np.zeros(len(mesh.vertices))
    start[seeds] = 1.0
    inner = csc_matrix(heat[free][:, free])
    warmth = start.copy()
    warmth[free] = factor(inner).solve(-(heat[free] @ start))
    wanted = -_unit(mesh.slopes(warmth))
    solver = factor(csc_matrix(mesh.stiffness[free][:, free]))
    for _ in range(rounds):
        values[free] = solver.solve(mesh.divergence(wanted)[free])
        wanted = _unit(mesh.slopes(values))
    return np.maximum(values, 0.0)


def distance_across(mesh: FineMesh, side: np.ndarray) -> np.ndarray:
    """A function (v,) with the level lines of `side` (v,), made as even as the surface allows, m.

    Where `side` is a height over a plane, it is nearly the distance along the surface from that
    plane, and its lines run straight past holes. Where the surface turns over, so that the height
    falls again, it is the distance from the lines on which `side` is 0 instead (`signed_distance`),
    where that is more even.
    """
    straight = even_field(mesh, _unit(mesh.slopes(side)), _ROUNDS)
    share = even_share(mesh, straight)
    if share >= _EVEN or side.min() >= 0.0 or side.max() <= 0.0:
        return straight
    geodesic = signed_distance(mesh, side)
    return geodesic if even_share(mesh, geodesic) > share + _MORE_EVEN else straight


def even_share(mesh: FineMesh, values: np.ndarray, uneven: float = 0.15) -> float:
    """Share of the area on which lines of a function (v,) are 1 ± `uneven` of its steps apart."""
    slope = np.linalg.norm(mesh.slopes(values), axis=1)
    even = (slope > 1.0 / (1.0 + uneven)) & (slope < 1.0 / (1.0 - uneven))
    return float(mesh.areas[even].sum() / mesh.areas.sum())


def signed_distance(mesh: FineMesh, side: np.ndarray, rounds: int = _ROUNDS) -> np.ndarray:
    """Signed distance (v,) along the surface from the lines on which `side` (v,) is 0, m.

    Negative where `side` is. The mesh hangs together; raises ValueError where `side` is nowhere 0.
    """
    lines = level_lines(mesh, side, np.zeros(1))
    if not lines:
        raise ValueError("the seed line is nowhere on the mesh")
    source = np.zeros(len(mesh.vertices))
    for line in lines:
        length = np.linalg.norm(np.diff(line.points, axis=0), axis=1)
        weight = 0.5 * (np.append(length, 0.0) + np.insert(length, 0, 0.0))
        np.add.at(source, line.corners[:, 0], weight * (1.0 - line.share))
        np.add.at(source, line.corners[:, 1], weight * line.share)
    warmth = factor(_heat(mesh)).solve(source)
    wanted = -_unit(mesh.slopes(warmth))
    corner = side[mesh.faces]
    wanted[(corner < 0.0).all(axis=1)] *= -1.0
    crossed = (corner < 0.0).any(axis=1) & (corner >= 0.0).any(axis=1)
    wanted[crossed] = _unit(mesh.slopes(side))[crossed]
    values = even_field(mesh, wanted, rounds)
    return values - float(source @ values) / float(source.sum())


def even_field(mesh: FineMesh, wanted: np.ndarray, rounds: int) -> np.ndarray:
    """The function (v,) whose gradients are nearest to `wanted` (f, 3), then nearest to length 1.

    Its mean is 0.
    """
    if "poisson" not in mesh.memo:
        # A little mass keeps the matrix, which knows no constant, regular.
        small = 1e-9 / max(float(mesh.areas.sum()), 1e-300)
        mesh.memo["poisson"] = factor(csc_matrix(mesh.stiffness + diags(small * mesh.mass)))
    solver = mesh.memo["poisson"]
    values = np.zeros(len(mesh.vertices))
    for _ in range(rounds):
        values = solver.solve(mesh.divergence(wanted))
        wanted = _unit(mesh.slopes(values))
    return np.asarray(values - np.average(values, weights=mesh.mass))


def _heat(mesh: FineMesh) -> csc_matrix:
    extent = float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))
    step = max(mesh.edge_m, extent / _LONG_HEAT)
    return csc_matrix(diags(mesh.mass) + step**2 * mesh.stiffness)


def factor(matrix: csc_matrix) -> SuperLU:
    """A symmetric positive matrix (n, n) made ready to solve with."""
    return splu(
        matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )


def _unit(vectors: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.maximum(length, 1e-300))
