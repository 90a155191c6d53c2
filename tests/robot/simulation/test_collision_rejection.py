from __future__ import annotations

import numpy as np

from nrdf.robot.planning.program import find_home
from nrdf.robot.simulation.collision_rejection import run


def run_it(wall, paths, shift):
    rng = np.random.default_rng(0)
    home = find_home(wall.cell, wall.library)
    return run(
        wall.cell, "top", wall.path.groups, paths, home, wall.library, rng, wall.surface,
        wall.surface, np.array(shift),
    )  # fmt: skip


def test_path_sections_that_collide_are_rejected_and_told(wall, wall_paths):
    whole = run_it(wall, wall_paths[0], (0.0, 0.0, 0.0))
    assert not whole.rejected and not whole.collisions
    # The wall comes nearer by more than the clearance that was planned with.
    done = run_it(wall, wall_paths[0], (-0.012, 0.0, 0.0))
    assert "process" in {c.kind for c in done.rejected}
    assert not done.collisions
    left = {k for p in done.program.joint_paths for k in range(p.first, p.last + 1)}
    assert set(range(8)) <= left and 11 not in left
