"""Where the arm's base and the object stand: the placement that reaches most waypoints."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nrdf.robot.model.arm import Arm
from nrdf.robot.model.cell import Cell, Placement
from nrdf.robot.model.signed_distance import SignedDistanceField
from nrdf.robot.model.tool import tool_of
from nrdf.robot.planning.inverse_kinematics import SeedLibrary
from nrdf.robot.planning.reachability import solve_everywhere
from nrdf.toolpath.types import ToolPath

_SAMPLE_SIZE = 60  # waypoints that each placement is judged by
_SEEDS = 4
_LIBRARY = 12_000
_DISTANCES = (0.55, 0.7, 0.85)  # of the base from the turntable's axis, shares of the arm's reach
_HEIGHTS = (0.3, 0.6, 0.9)  # of the base above the object's lowest point, shares of its height
_STANDS = (0.4, 0.0)  # of the object above the floor, m
_LEAST_GAP = 0.15  # between the object as it turns and the middle of the base


def find_placement(
    arm: Arm,
    paths: Sequence[ToolPath],
    distance_field: SignedDistanceField,
    upright: np.ndarray,
    given: Placement | None,
    turntable_positions: int,
    rng: np.random.Generator,
) -> tuple[Placement, float]:
    """The best of a grid of placements, and the share of a sample of waypoints that it reaches at
    some turntable index; only that share where a placement is given.

    upright: (3, 3), as `nrdf.robot.model.cell.upright_rotation` has it.
    """
    sample = _sample(paths, rng)
    found: list[tuple[float, Placement]] = []
    candidates = (
        [given]
        if given is not None
        else _candidates(arm, distance_field, upright, turntable_positions)
    )
    cells: dict[int, tuple[Cell, SeedLibrary]] = {}
    for placement in candidates:
        reached = 0.0
        for number, (path, positions, axes) in enumerate(sample):
            if number not in cells:
                cell = Cell.build(arm, tool_of(path), distance_field, placement, upright)
                library = next(
                    (
                        library
                        for _, library in cells.values()
                        if np.array_equal(library.T_flange_tcp, cell.tool.T_flange_tcp)
                    ),
                    None,
                )
                cells[number] = (cell, library or SeedLibrary.build(cell, _LIBRARY, rng))
            cell, library = cells[number]
            cell = cell.with_placement(placement, upright)
            reached += solve_everywhere(cell, library, positions, axes, _SEEDS)[1].regular.sum()
        found.append((reached / sum(len(p) for _, p, _ in sample), placement))
    share, best = max(found, key=lambda pair: pair[0])
    return best, share


def _sample(
    paths: Sequence[ToolPath], rng: np.random.Generator
) -> list[tuple[ToolPath, np.ndarray, np.ndarray]]:
    every = [
        (
            path,
            np.concatenate([group.process.positions for group in path.groups]),
            np.concatenate([group.process.axes for group in path.groups]),
        )
        for path in paths
    ]
    total = sum(len(positions) for _, positions, _ in every)
    chosen = []
    for path, positions, axes in every:
        count = max(round(_SAMPLE_SIZE * len(positions) / total), 4)
        index = rng.permutation(len(positions))[:count]
        chosen.append((path, positions[index], axes[index]))
    return chosen


def _candidates(
    arm: Arm, distance_field: SignedDistanceField, upright: np.ndarray, turntable_positions: int
) -> list[Placement]:
    """Bases around a turntable: distance, height, and whether the object is raised."""
    chain = arm.chain
    reach = float(np.linalg.norm(chain.origins[1:, :3, 3], axis=1).sum())
    size = np.ptp(distance_field.samples @ upright.T, axis=0)
    height = float(size[2])
    radius = 0.5 * float(np.hypot(size[0], size[1]))
    angles = tuple((2.0 * np.pi * np.arange(turntable_positions) / turntable_positions).tolist())
    made = []
    for stand in _STANDS:
        for share in _HEIGHTS:
            for distance in _DISTANCES:
                away = max(distance * reach, radius + _LEAST_GAP)
                base = (away, 0.0, round(stand + share * height, 3))
                made.append(Placement(base, np.pi, stand, angles))
    return made
