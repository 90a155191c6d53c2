"""Free moves between strokes: straight in the joints where nothing is in the way, else around it.

For each turn of the object a tree grows from the home position. Every stroke's ends are joined to
it: by an edge, over a configuration of the arm's library that is clear, or by a random tree of
their own (RRT-connect; Kuffner and LaValle, 2000).
"""

from __future__ import annotations

import numpy as np

from nrdf.robot.model.cell import Cell
from nrdf.robot.planning.inverse_kinematics import LEAST_CLEARANCE_M, Library

_STEP_RAD, _FINE_M = 0.08, 0.008
_SLACK = 0.7  # of the way between two places, by which the arm may come nearer than at both
_CLEAR_M = 0.75 * LEAST_CLEARANCE_M  # the ends of strokes may be as near as they are
_TRIED_EDGES, _TRIED_BRIDGES = 8, 25
_BRIDGES, _WIDE_M = 1500, 0.02  # looked at, and how clear they must be
_EXTENSION_RAD = 0.5
_MOST_EXTENSIONS = 80
_SHORTCUTS = 12


class Roadmap:
    """Free moves at one turn of the object, from and to anywhere."""

    def __init__(
        self,
        cell: Cell,
        library: Library,
        turn: int,
        home: np.ndarray,
        rng: np.random.Generator,
    ) -> None:
        self.cell, self.turn, self.rng = cell, turn, rng
        some = library.joints[:_BRIDGES]
        # Whole turns do not matter to where the arm is, but to how far it is from home.
        near = home + np.mod(some - home + np.pi, 2.0 * np.pi) - np.pi
        inside = (near > cell.chain.lower) & (near < cell.chain.upper)
        some = np.where(inside & ~cell.chain.slides, near, some)
        frames = cell.chain.frames(some)
        clear = cell.clearance(frames, np.full(len(some), turn)).least
        self._bridges = some[np.minimum(clear, cell.own_clearance(frames)) > _WIDE_M]
        self.nodes = home[None].copy()
        self.parents = [-1]

    def link(self, joints: np.ndarray) -> int | None:
        """The number of a node at joints (n,), joined to the tree by an edge or over a bridge; None
        where neither is free."""
        node = self._edge(joints, _TRIED_EDGES)
        if node is not None:
            return self._add(joints, node)
        for bridge in self._bridges[self._nearest_index(self._bridges, joints, _TRIED_BRIDGES)]:
            if self.free(bridge, joints):
                node = self._edge(bridge, _TRIED_EDGES)
                if node is not None:
                    return self._add(joints, self._add(bridge, node))
        return None

    def _edge(self, joints: np.ndarray, tries: int) -> int | None:
        for node in self._nearest_index(self.nodes, joints, tries):
            if self.free(self.nodes[node], joints):
                return int(node)
        return None

    def way(self, one: int, other: int) -> np.ndarray:
        """Joints (k, n) at the corners of a free move between two nodes, as few as may be."""
        up, down = self._to_root(one), self._to_root(other)
        common = next(node for node in up if node in set(down))
        route = up[: up.index(common) + 1] + down[: down.index(common)][::-1]
        return self._shortened(self.nodes[route])

    def free(self, one: np.ndarray, other: np.ndarray) -> bool:
        """Whether the straight move between two places hits nothing."""
        return self._free_steps(one, other) == 1.0

    def _free_steps(self, one: np.ndarray, other: np.ndarray) -> float:
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

        From the arm itself only up to where something else is hit, which is the quicker question.
        """
        frames = self.cell.chain.frames(joints)
        parts = np.concatenate([frames.places, frames.tcp[None]])
        moved = np.linalg.norm(np.diff(parts, axis=1), axis=2).max(axis=0)
        least = self.cell.clearance(frames, np.full(len(joints), self.turn)).least
        hit = np.flatnonzero(least <= _CLEAR_M)
        asked = int(hit[0]) if len(hit) else len(joints)
        if asked:
            frames = frames if asked == len(joints) else self.cell.chain.frames(joints[:asked])
            own = self.cell.own_clearance(frames)
            least[:asked] = np.minimum(least[:asked], own)
        return least, moved

    def explore(self, joints: np.ndarray) -> int | None:
        """As `link`, by a random tree that grows from there."""
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
            share = self._free_steps(nodes[start], aim)
            if share < 0.2:
                continue
            reached = nodes[start] + share * (aim - nodes[start])
            if share < 1.0 and not self.free(nodes[start], reached):
                continue  # what is before a hit has not been looked at closely
            nodes.append(reached)
            parents.append(start)
            for node in self._nearest_index(self.nodes, reached, 3):
                if self.free(self.nodes[node], reached):
                    return self._graft(nodes, parents, int(node))
        return None

    def _graft(self, nodes: list[np.ndarray], parents: list[int], node: int) -> int:
        """Add the way from the last of a tree's nodes back to its root; the root's number."""
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

    def _shortened(self, way: np.ndarray) -> np.ndarray:
        for _ in range(_SHORTCUTS):
            if len(way) < 3:
                break
            # The longest shortcut that is free, tried from both ends inwards.
            done = True
            for gap in range(len(way) - 1, 1, -1):
                for i in range(len(way) - gap):
                    if self.free(way[i], way[i + gap]):
                        way = np.concatenate([way[: i + 1], way[i + gap :]])
                        done = False
                        break
                if not done:
                    break
            if done:
                break
        return way

    @staticmethod
    def _nearest_index(nodes: np.ndarray, joints: np.ndarray, count: int) -> np.ndarray:
        return np.argsort(np.abs(nodes - joints).max(axis=1))[:count]
