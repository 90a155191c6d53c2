"""Unrolling a bent patch of a cloud into the plane, as nearly without stretch as can be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from nrdf.geometry.frames import tangent_frames

_ROUNDS = 12


@dataclass(frozen=True)
class Unrolled:
    """A patch in the plane.

    uv: (n, 2), m, right-handed seen from outside. tangents: (n, 2, 3), the directions on the
    surface that u and v run along at each point. error: (n,), the share of its edges' lengths by
    which a point's neighbourhood had to be bent.
    """

    uv: np.ndarray
    tangents: np.ndarray
    error: np.ndarray

    def among(self, kept: np.ndarray) -> Unrolled:
        """The patch with those of its points alone that are `kept`, mask (n,)."""
        return Unrolled(self.uv[kept], self.tangents[kept], self.error[kept])


def unroll(points: np.ndarray, normals: np.ndarray, edges: np.ndarray, spacing: float) -> Unrolled:
    """Unroll connected points (n, 3) with unit normals (n, 3), along edges (e, 2).

    "As rigid as possible" (Liu et al., 2008) on the tangent planes of the points instead of
    triangles: each neighbourhood is laid flat, turned, and all are joined by one Poisson equation;
    turning and joining alternate. The first turns are a direction transported from the middle (the
    vector heat method: Sharp et al., 2019). Tangent vectors are complex numbers.
    """
    n = len(points)
    i, j = np.concatenate([edges, edges[:, ::-1]]).T
    back = np.roll(np.arange(len(i)), len(edges))  # the edge j, i of each edge i, j
    frames = tangent_frames(normals)
    offset = points[j] - points[i]
    length = np.linalg.norm(offset, axis=1) + 1e-12
    x, y = np.einsum("eba,ea->be", frames[i, :2], offset)
    flat = x + 1j * y
    flat *= length / np.maximum(np.abs(flat), 1e-12)
    weight = np.exp(-0.5 * (length / spacing) ** 2) + 1e-3
    degree = np.bincount(i, weight, n)

    def gather(values: np.ndarray) -> np.ndarray:
        return np.bincount(i, values.real, n) + 1j * np.bincount(i, values.imag, n)

    turned = -flat / flat[back]
    transport = sparse.csr_matrix((weight * turned / np.abs(turned), (i, j)), (n, n))
    middle = int(np.argmin(((points - points.mean(axis=0)) ** 2).sum(axis=1)))
    reach = np.linalg.norm(points - points[middle], axis=1).max() + spacing
    step = 0.5 * reach**2 / ((weight * length**2).sum() / n)
    source = np.zeros(n, dtype=complex)
    source[middle] = 1.0
    heat = sparse.identity(n) + step * (sparse.diags(degree) - transport)
    spread = _factor(heat).solve(source)
    turn = np.conj(spread / np.maximum(np.abs(spread), 1e-300))

    laplacian = sparse.diags(degree * (1.0 + 1e-9)) - sparse.csr_matrix((weight, (i, j)), (n, n))
    joined = _factor(laplacian)
    for _ in range(_ROUNDS):
        wanted = 0.5 * (turn[i] * flat - turn[j] * flat[back])
        pull = -gather(weight * wanted)
        z = joined.solve(pull.real) + 1j * joined.solve(pull.imag)
        turn = gather(weight * np.conj(flat) * (z[j] - z[i]))
        turn /= np.maximum(np.abs(turn), 1e-300)
    wanted = 0.5 * (turn[i] * flat - turn[j] * flat[back])
    bent = weight * (np.abs(z[j] - z[i] - wanted) / length) ** 2
    error = np.sqrt(np.bincount(i, bent, n) / np.maximum(degree, 1e-300))
    # Along its own principal axes, the patch lies the same way however the object does.
    z -= z.mean()
    axis = np.sqrt((z * z).mean() + 1e-300)
    axis /= np.abs(axis)
    skew = ((z * np.conj(axis)).real ** 3).mean()
    axis *= -1.0 if skew < 0.0 else 1.0
    z, turn = z * np.conj(axis), turn * np.conj(axis)
    # u runs along frame direction conj(turn), v along i conj(turn).
    c, s = turn.real[:, None], -turn.imag[:, None]
    along_u = c * frames[:, 0] + s * frames[:, 1]
    along_v = -s * frames[:, 0] + c * frames[:, 1]
    uv = np.stack([z.real, z.imag], axis=1)
    return Unrolled(uv, np.stack([along_u, along_v], axis=1), error)


def _factor(matrix: sparse.spmatrix) -> splu:
    options = {"SymmetricMode": True}
    return splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", options=options)
