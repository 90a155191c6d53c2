"""A serial arm's forward kinematics and Jacobian, for many configurations at once."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from nrdf.geometry.frames import rotations_about


@dataclass(frozen=True)
class Chain:
    """Joints in a row from the base to a tool.

    origins: (n, 4, 4), each joint's frame in the frame of the joint before it, at angle 0; axes:
    (n, 3) unit, in the joint's own frame; slides: (n,) bool, for prismatic joints. T_last_tool:
    (4, 4), the tool frame in the last joint's. lower, upper: (n,) limits, rad or m; speeds: (n,),
    rad/s or m/s.
    """

    origins: np.ndarray
    axes: np.ndarray
    slides: np.ndarray
    T_last_tool: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    speeds: np.ndarray

    @property
    def size(self) -> int:
        """The number of joints."""
        return len(self.axes)

    def with_tool(self, T_tool_tcp: np.ndarray) -> Chain:
        """The same arm with a tool centre point at (4, 4) in the present tool frame."""
        return replace(self, T_last_tool=self.T_last_tool @ T_tool_tcp)

    def frames(self, joints: np.ndarray) -> Frames:
        """Where everything is at joints (b, n)."""
        count = len(joints)
        rotations = np.empty((self.size + 1, count, 3, 3))
        positions = np.empty((self.size + 1, count, 3))
        rotations[0], positions[0] = np.eye(3), 0.0
        for i in range(self.size):
            origin = self.origins[i]
            turned = rotations[i] @ origin[:3, :3]
            positions[i + 1] = positions[i] + rotations[i] @ origin[:3, 3]
            if self.slides[i]:
                positions[i + 1] += (turned @ self.axes[i]) * joints[:, i, None]
                rotations[i + 1] = turned
            else:
                rotations[i + 1] = turned @ rotations_about(self.axes[i], joints[:, i])
        tool = rotations[-1] @ self.T_last_tool[:3, :3]
        tcp = positions[-1] + rotations[-1] @ self.T_last_tool[:3, 3]
        return Frames(self, rotations, positions, tool, tcp)


@dataclass(frozen=True)
class Frames:
    """Frames of b configurations in the base's frame.

    rotations: (n + 1, b, 3, 3) and positions: (n + 1, b, 3) of the base and of each joint; tool:
    (b, 3, 3) and tcp: (b, 3) of the tool.
    """

    chain: Chain
    rotations: np.ndarray
    positions: np.ndarray
    tool: np.ndarray
    tcp: np.ndarray

    def jacobian(self) -> tuple[np.ndarray, np.ndarray]:
        """Of the tool centre point's motion (b, 3, n), and of the tool's rotation (b, 3, n)."""
        return self.jacobian_at(self.tcp[:, None])[:, 0], self._rotation_jacobian()

    def axes(self) -> np.ndarray:
        """Joint axes (b, n, 3)."""
        # A joint turns about its own axis, so its rotation leaves the axis where it is.
        return np.einsum("nbij,nj->bni", self.rotations[1:], self.chain.axes)

    def jacobian_at(self, points: np.ndarray) -> np.ndarray:
        """Of the motion of points (b, m, 3), as if fixed to the last joint: (b, m, 3, n)."""
        axes = self.axes()
        arm = points[:, :, None] - np.moveaxis(self.positions[1:], 0, 1)[:, None]
        moved = _cross(axes[:, None], arm)
        if self.chain.slides.any():
            moved = np.where(self.chain.slides[:, None], axes[:, None], moved)
        return np.swapaxes(moved, 2, 3)

    def _rotation_jacobian(self) -> np.ndarray:
        axes = np.where(self.chain.slides[:, None], 0.0, self.axes())
        return np.swapaxes(axes, 1, 2)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    # np.cross spends most of its time on checks.
    x = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    y = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    z = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return np.stack([x, y, z], axis=-1)
