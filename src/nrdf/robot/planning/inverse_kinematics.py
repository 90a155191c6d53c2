"""Inverse kinematics for many targets at once: damped least squares with the spin left free.

A round tool may turn about its axis, so a target is a position and an axis: five numbers for six or
seven joints. The null space keeps the arm off limits and obstacles (gradient projection; Siciliano
et al., Robotics, 2009, section 3.5).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from nrdf.robot.model.cell import Cell, Clearance
from nrdf.robot.model.kinematics import Chain, Frames

POSITION_M = 2e-5
"""Largest distance from a target that counts as reached; the bar is 0.1 mm."""
AXIS_RAD = 3e-4
"""The same for the tool's axis; the bar is 0.1°, 1.7e-3 rad."""
LEAST_CLEARANCE_M = 0.004
"""Closer to the object, the floor or itself, the arm counts as colliding."""
LEAST_SINGULAR = 0.03
"""Least singular value of the task's Jacobian, m (axes count 0.3 m a radian), of a configuration
that is not singular. Below it, small motions of the tool need large ones of the joints."""
_LENGTH_M = 0.3  # by which angles are weighed against lengths
_MAX_STEP_RAD = 0.4
_WANTED_CLEARANCE_M = 0.06
_LIMIT_SHARE = 0.85


def task_jacobian(frames: Frames) -> tuple[np.ndarray, np.ndarray]:
    """Jacobian (b, 5, n) of position and axis, and tool x and y (b, 2, 3), about which the axis
    turns."""
    linear, angular = frames.jacobian()
    across = np.swapaxes(frames.tool[:, :, :2], 1, 2)
    return np.concatenate([linear, _LENGTH_M * (across @ angular)], axis=1), across


def pose_errors(
    frames: Frames, positions: np.ndarray, axes: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Distance (b,), m, and angle (b,), rad, between tools and targets (b, 3), (b, 3)."""
    distance = np.linalg.norm(positions - frames.tcp, axis=1)
    cross = np.cross(frames.tool[:, :, 2], axes)
    sine = np.linalg.norm(cross, axis=1)
    return distance, np.arctan2(sine, np.einsum("ba,ba->b", frames.tool[:, :, 2], axes))


def singular_values(frames: Frames) -> np.ndarray:
    """The least singular value (b,) of the task's Jacobian."""
    jacobian = task_jacobian(frames)[0]
    squared = np.linalg.eigvalsh(jacobian @ np.swapaxes(jacobian, 1, 2))[:, 0]
    return np.sqrt(np.maximum(squared, 0.0))


def damped_least_squares_step(
    chain: Chain,
    frames: Frames,
    joints: np.ndarray,
    positions: np.ndarray,
    axes: np.ndarray,
    gradient: np.ndarray | None = None,
) -> np.ndarray:
    """One damped least-squares step of joints (b, n) towards targets (b, 3), (b, 3).

    gradient: (b, n), followed in the null space, as far as the target allows. Joint limits are
    kept.
    """
    jacobian, across = task_jacobian(frames)
    cross = np.cross(frames.tool[:, :, 2], axes)
    sine = np.linalg.norm(cross, axis=1)
    angle = np.arctan2(sine, np.einsum("ba,ba->b", frames.tool[:, :, 2], axes))
    cross *= (angle / np.maximum(sine, 1e-9))[:, None]
    error = np.concatenate(
        [positions - frames.tcp, _LENGTH_M * np.einsum("bka,ba->bk", across, cross)], axis=1
    )
    size = np.linalg.norm(error, axis=1)
    damping = 1e-7 + 3e-3 * np.minimum(size, 0.3) ** 2
    if gradient is not None:
        error = error - np.einsum("bij,bj->bi", jacobian, gradient)
    square = jacobian @ np.swapaxes(jacobian, 1, 2)
    square[:, np.arange(5), np.arange(5)] += damping[:, None]
    solved = np.linalg.solve(square, error[..., None])
    step = (np.swapaxes(jacobian, 1, 2) @ solved)[..., 0]
    if gradient is not None:
        step += gradient
    longest = np.abs(step).max(axis=1, keepdims=True)
    step *= np.minimum(1.0, _MAX_STEP_RAD / np.maximum(longest, 1e-9))
    return np.asarray(np.clip(joints + step, chain.lower, chain.upper))


def solve(
    chain: Chain,
    joints: np.ndarray,
    positions: np.ndarray,
    axes: np.ndarray,
    iterations: int = 30,
) -> tuple[np.ndarray, np.ndarray]:
    """Joints (b, n) that bring the tool to targets, from seeds; whether (b,) they do."""
    joints = joints.copy()
    converged = np.zeros(len(joints), bool)
    moving: np.ndarray = np.arange(len(joints))
    for k in range(iterations + 1):
        frames = chain.frames(joints[moving])
        distance, angle = pose_errors(frames, positions[moving], axes[moving])
        arrived = (distance < POSITION_M) & (angle < AXIS_RAD)
        converged[moving[arrived]] = True
        # After some iterations those that are still far will not converge.
        hopeless = (k >= 12) & (distance > 0.05)
        kept = ~arrived & ~hopeless
        moving = moving[kept]
        if not len(moving) or k == iterations:
            break
        frames = _select(frames, kept)
        joints[moving] = damped_least_squares_step(
            chain, frames, joints[moving], positions[moving], axes[moving]
        )
    return joints, converged


def _select(frames: Frames, kept: np.ndarray) -> Frames:
    return Frames(
        frames.chain,
        frames.rotations[:, kept],
        frames.positions[:, kept],
        frames.tool[kept],
        frames.tcp[kept],
    )


def null_space_gradient(
    cell: Cell, frames: Frames, joints: np.ndarray, near: Clearance
) -> np.ndarray:
    """Joint motions (b, n) away from the nearest obstacle and from the joints' limits."""
    chain = cell.chain
    short = np.clip(_WANTED_CLEARANCE_M - near.least, 0.0, _WANTED_CLEARANCE_M)
    moved = frames.jacobian_at(near.point[:, None])[:, 0]
    link = cell.spheres.links[near.sphere]
    moved *= (np.arange(chain.size) < link[:, None])[:, None]
    away = np.einsum("ban,ba->bn", moved, near.gradient)
    size = np.linalg.norm(away, axis=1, keepdims=True)
    gradient = 1.5 * short[:, None] / np.maximum(size, 0.15) * away / np.maximum(size, 1e-9)
    middle, half = 0.5 * (chain.lower + chain.upper), 0.5 * (chain.upper - chain.lower)
    share = (joints - middle) / half
    gradient -= 0.3 * np.sign(share) * np.maximum(np.abs(share) - _LIMIT_SHARE, 0.0)
    return np.clip(gradient, -0.02, 0.02)


@dataclass(frozen=True)
class SeedLibrary:
    """Configurations of an arm with a tool, found by the tool pose that they have: seeds to solve
    from. joints: (m, n)."""

    joints: np.ndarray
    tree: cKDTree
    T_flange_tcp: np.ndarray

    @staticmethod
    def build(cell: Cell, count: int, rng: np.random.Generator) -> SeedLibrary:
        """`count` random configurations, without those that hit the arm itself or the floor."""
        chain = cell.chain
        low, high = np.maximum(chain.lower, -np.pi), np.minimum(chain.upper, np.pi)
        joints = rng.uniform(low, high, (count, chain.size))
        kept, keys = [], []
        for part in np.array_split(joints, max(count // 2000, 1)):
            frames = chain.frames(part)
            good = cell.self_clearance(frames) > LEAST_CLEARANCE_M
            centres = (
                cell.spheres.at(frames.rotations, frames.positions)[..., 2] - cell.spheres.radii
            )
            good &= centres[:, cell.spheres.links > 0].min(axis=1) > cell.floor_m
            kept.append(part[good])
            keys.append(_key(frames.tcp[good], frames.tool[good, :, 2]))
        tree = cKDTree(np.concatenate(keys))
        return SeedLibrary(np.concatenate(kept), tree, cell.tool.T_flange_tcp)

    def nearest(self, positions: np.ndarray, axes: np.ndarray, count: int) -> np.ndarray:
        """Seeds (b, count, n) for targets (b, 3), (b, 3)."""
        near = self.tree.query(_key(positions, axes), count)[1]
        return np.asarray(self.joints[near.reshape(len(positions), count)])


def _key(positions: np.ndarray, axes: np.ndarray) -> np.ndarray:
    return np.concatenate([positions, _LENGTH_M * axes], axis=1)
