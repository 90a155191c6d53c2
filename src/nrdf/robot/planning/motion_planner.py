"""The motion planner: free moves between joint paths, straight in the joints or around obstacles.

For each turntable index a roadmap, a tree, grows from the home configuration. The ends of every
joint path are connected to it: by an edge, over a collision-free configuration of the seed library,
or by a random tree of their own (RRT-connect; Kuffner and LaValle, 2000).
"""

from __future__ import annotations

import numpy as np

from nrdf.geometry.polylines import interpolate, summed
from nrdf.robot.model.cell import Cell
from nrdf.robot.planning.inverse_kinematics import LEAST_CLEARANCE_M, SeedLibrary

_STEP_RAD, _FINE_M = 0.08, 0.008
_SLACK = 0.7  # share of a step by which the arm may come nearer than at both its ends
_CLEAR_M = 0.75 * LEAST_CLEARANCE_M  # the ends of joint paths may be as near as they are
_TRIED_EDGES, _TRIED_BRIDGES = 8, 25
_BRIDGES, _BRIDGE_CLEARANCE_M = 1500, 0.02
_EXTENSION_RAD = 0.5
_MOST_EXTENSIONS = 80
_SHORTCUTS = 12
_CUTS = 24  # of corners, tried at random
_CORNER_S = 0.25  # that a stop at a corner takes


class Roadmap:
    """Free moves at one turntable index, from and to anywhere."""

    def __init__(
        self,
        cell: Cell,
        library: SeedLibrary,
        turntable_index: int,
        home: np.ndarray,
        rng: np.random.Generator,
    ) -> None:
        self.cell, self.turntable_index, self.rng = cell, turntable_index, rng
        some = library.joints[:_BRIDGES]
        # Whole turns do not matter to where the arm is, but to how far it is from home.
        near = home + np.mod(some - home + np.pi, 2.0 * np.pi) - np.pi
        inside = (near > cell.chain.lower) & (near < cell.chain.upper)
        some = np.where(inside & ~cell.chain.slides, near, some)
        frames = cell.chain.frames(some)
        clear = cell.clearance(frames, np.full(len(some), turntable_index)).least
        self._bridges = some[np.minimum(clear, cell.self_clearance(frames)) > _BRIDGE_CLEARANCE_M]
        self.nodes = home[None].copy()
        self.parents = [-1]

    def connect(self, joints: np.ndarray) -> int | None:
        """The number of a node at joints (n,), connected by an edge or over a bridge; None where
        neither is free."""
        node = self._edge(joints, _TRIED_EDGES)
        if node is not None:
            return self._add(joints, node)
        for bridge in self._bridges[self._nearest_index(self._bridges, joints, _TRIED_BRIDGES)]:
            if self.is_free(bridge, joints):
                node = self._edge(bridge, _TRIED_EDGES)
                if node is not None:
                    return self._add(joints, self._add(bridge, node))
        return None

    def _edge(self, joints: np.ndarray, tries: int) -> int | None:
        for node in self._nearest_index(self.nodes, joints, tries):
            if self.is_free(self.nodes[node], joints):
                return int(node)
        return None

    def path(self, one: int, other: int) -> np.ndarray:
        """Joints (k, n) at the corners of a free move between two nodes, a short way round."""
        up, down = self._to_root(one), self._to_root(other)
        common = next(node for node in up if node in set(down))
        route = up[: up.index(common) + 1] + down[: down.index(common)][::-1]
        return self._cut_short(self._shortened(self.nodes[route]))

    def is_free(self, one: np.ndarray, other: np.ndarray) -> bool:
        """Whether the straight move between two configurations hits nothing."""
        return self._free_share(one, other) == 1.0

    def _free_share(self, one: np.ndarray, other: np.ndarray) -> float:
        """The share of a straight move that hits nothing, from its beginning."""
        count = max(int(np.ceil(np.abs(other - one).max() / _STEP_RAD)), 1)
        share = np.linspace(0.0, 1.0, count + 1)
        clear, moved = self._clearance(one + share[:, None] * (other - one))
        blocked = clear[1:] <= _CLEAR_M
        if blocked.any():
            return float(share[int(np.argmax(blocked))]) * 0.7
        # Where something is nearer than the arm moves in a step, looks in between as well.
        near = np.minimum(clear[:-1], clear[1:]) < _SLACK * moved
        finer = np.ceil(moved[near] / _FINE_M).astype(int)
        parts = [
            s + np.arange(1, k) / k / count for s, k in zip(share[:-1][near], finer, strict=True)
        ]
        fine = np.concatenate([*parts, np.zeros(0)])
        if len(fine):
            blocked = self._clearance(one + fine[:, None] * (other - one))[0] <= _CLEAR_M
            if blocked.any():
                return max(float(fine[int(np.argmax(blocked))]) - 1.0 / count, 0.0)
        return 1.0

    def _clearance(self, joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Of joints (k, n) along a move, and how far (k - 1,), m, the arm's parts go between them.

        From the arm itself only up to where something else is hit, which is quicker to find.
        """
        frames = self.cell.chain.frames(joints)
        parts = np.concatenate([frames.positions, frames.tcp[None]])
        moved = np.linalg.norm(np.diff(parts, axis=1), axis=2).max(axis=0)
        least = self.cell.clearance(frames, np.full(len(joints), self.turntable_index)).least
        hit = np.flatnonzero(least <= _CLEAR_M)
        count = int(hit[0]) if len(hit) else len(joints)
        if count:
            frames = frames if count == len(joints) else self.cell.chain.frames(joints[:count])
            own = self.cell.self_clearance(frames)
            least[:count] = np.minimum(least[:count], own)
        return least, moved

    def connect_by_rrt(self, joints: np.ndarray) -> int | None:
        """As `connect`, by a random tree that grows from there."""
        chain = self.cell.chain
        low, high = np.maximum(chain.lower, -np.pi), np.minimum(chain.upper, np.pi)
        nodes, parents = [joints], [-1]
        for k in range(_MOST_EXTENSIONS):
            if k % 3 == 0:
                aim = self.nodes[self.rng.integers(len(self.nodes))]
            elif k % 3 == 1:
                aim = nodes[-1] + self.rng.normal(0.0, 0.5, chain.size)
            else:
                aim = self.rng.uniform(low, high)
            every = np.array(nodes)
            start = int(np.abs(every - aim).max(axis=1).argmin())
            away = aim - nodes[start]
            longest = float(np.abs(away).max())
            if longest < 1e-6:
                continue
            aim = nodes[start] + away * min(1.0, _EXTENSION_RAD / longest)
            aim = np.clip(aim, chain.lower, chain.upper)
            share = self._free_share(nodes[start], aim)
            if share < 0.2:
                continue
            reached = nodes[start] + share * (aim - nodes[start])
            if share < 1.0 and not self.is_free(nodes[start], reached):
                continue  # what is before a hit has not been checked closely
            nodes.append(reached)
            parents.append(start)
            for node in self._nearest_index(self.nodes, reached, 3):
                if self.is_free(self.nodes[node], reached):
                    return self._graft(nodes, parents, int(node))
        return None

    def _graft(self, nodes: list[np.ndarray], parents: list[int], node: int) -> int:
        """Add the route from the last of a tree's nodes back to its root; the root's number."""
        at = len(nodes) - 1
        while at >= 0:
            node = self._add(nodes[at], node)
            at = parents[at]
        return node

    def _add(self, joints: np.ndarray, parent: int) -> int:
        self.nodes = np.concatenate([self.nodes, joints[None]])
        self.parents.append(parent)
        return len(self.parents) - 1

    def _to_root(self, node: int) -> list[int]:
        route = [node]
        while self.parents[route[-1]] >= 0:
            route.append(self.parents[route[-1]])
        return route

    def _shortened(self, path: np.ndarray) -> np.ndarray:
        for _ in range(_SHORTCUTS):
            if len(path) < 3:
                break
            # The longest shortcut that is free, tried from both ends inwards.
            done = True
            for gap in range(len(path) - 1, 1, -1):
                for i in range(len(path) - gap):
                    if self.is_free(path[i], path[i + gap]):
                        path = np.concatenate([path[: i + 1], path[i + gap :]])
                        done = False
                        break
                if not done:
                    break
            if done:
                break
        return path

    def _cut_short(self, path: np.ndarray) -> np.ndarray:
        """The path with straight moves between places inside its legs, where those are free
        (Geraerts and Overmars, 2007)."""
        speeds = self.cell.chain.speeds
        for _ in range(_CUTS):
            if len(path) < 3:
                break
            took = summed((np.abs(np.diff(path, axis=0)) / speeds).max(axis=1))
            at = np.sort(self.rng.uniform(0.0, took[-1], 2))
            leg = np.searchsorted(took, at, side="right") - 1
            if leg[0] == leg[1]:
                continue
            ends = interpolate(at, took, path)
            saved = at[1] - at[0] - float((np.abs(ends[1] - ends[0]) / speeds).max())
            corners = leg[1] - leg[0]
            if saved + _CORNER_S * (corners - 2) > 0.0 and self.is_free(ends[0], ends[1]):
                path = np.concatenate([path[: leg[0] + 1], ends, path[leg[1] + 1 :]])
        return self._shortened(path)

    @staticmethod
    def _nearest_index(nodes: np.ndarray, joints: np.ndarray, count: int) -> np.ndarray:
        return np.argsort(np.abs(nodes - joints).max(axis=1))[:count]
