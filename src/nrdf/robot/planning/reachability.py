"""Which poses the arm can reach, and in which configurations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nrdf.robot.model.cell import Cell
from nrdf.robot.planning.inverse_kinematics import (
    LEAST_CLEARANCE_M,
    LEAST_SINGULAR,
    SeedLibrary,
    singular_values,
    solve,
)

SEEDS = 6
"""Seeds that each target is solved from, at each turntable index."""


@dataclass(frozen=True)
class IKSolutions:
    """Configurations that reach targets: joints (b, n), index of the target (b,), turntable index
    (b,), and score (b,), the higher the farther from obstacles and singularities."""

    joints: np.ndarray
    target: np.ndarray
    turntable_index: np.ndarray
    score: np.ndarray


@dataclass(frozen=True)
class Reachability:
    """For targets (m,), whether some configuration at some turntable index is solved; is solved and
    collision-free; and is all that and not singular."""

    solved: np.ndarray
    collision_free: np.ndarray
    regular: np.ndarray


def solve_everywhere(
    cell: Cell,
    library: SeedLibrary,
    positions: np.ndarray,
    axes: np.ndarray,
    seeds: int = SEEDS,
) -> tuple[IKSolutions, Reachability]:
    """All configurations found for targets (m, 3), (m, 3) in the object's frame, at every turntable
    index; only those that are collision-free and not singular are solutions."""
    indices, count = len(cell.T_base_object), len(positions)
    index = np.tile(np.arange(indices), count)
    at, along = cell.to_base(index, positions.repeat(indices, axis=0), axes.repeat(indices, axis=0))
    joints = library.nearest(at, along, seeds).reshape(count * indices * seeds, -1)
    at, along = at.repeat(seeds, axis=0), along.repeat(seeds, axis=0)
    index = index.repeat(seeds)
    target = np.arange(count).repeat(indices * seeds)
    joints, converged = solve(cell.chain, joints, at, along)
    found = Reachability(*(np.zeros(count, bool) for _ in range(3)))
    found.solved[target[converged]] = True
    joints, index, target = joints[converged], index[converged], target[converged]
    frames = cell.chain.frames(joints)
    clearance = cell.clearance(frames, index).least
    kept = np.flatnonzero(clearance > LEAST_CLEARANCE_M)
    kept = kept[cell.self_clearance(cell.chain.frames(joints[kept])) > LEAST_CLEARANCE_M]
    found.collision_free[target[kept]] = True
    joints, index, target = joints[kept], index[kept], target[kept]
    least = singular_values(cell.chain.frames(joints))
    regular = least > LEAST_SINGULAR
    found.regular[target[regular]] = True
    score = np.minimum(clearance[kept], 0.04) / 0.04 + 0.5 * np.minimum(least / 0.12, 1.0)
    return IKSolutions(joints[regular], target[regular], index[regular], score[regular]), found
