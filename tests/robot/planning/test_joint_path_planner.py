from __future__ import annotations

import numpy as np

from builders.arm_cells import path_of
from nrdf.robot.planning.joint_path_planner import plan_joint_paths


def test_the_tool_tilts_away_from_a_wall_and_only_there(wall, wall_paths):
    paths, covered, _ = wall_paths
    assert covered[0].all()
    tilt = np.zeros(12)
    for path in paths:
        planned = wall.path.segments[0].axes[path.first : path.last + 1]
        cosine = (path.axes * planned).sum(axis=1)
        tilt[path.first : path.last + 1] = np.arccos(np.clip(cosine, -1.0, 1.0))
    assert (tilt[:10] < 1e-6).all()
    assert 0.01 < tilt[-1] < wall.cell.tool.max_tilt_rad + 1e-6
    tail = -next(path for path in paths if path.last == 11).axes[-1]
    assert tail[0] < -0.01


def test_why_a_waypoint_is_not_covered(wall):
    far = path_of(((5.0, 0.03, 0.0), (5.05, 0.03, 0.0)))
    paths, covered, reachability = plan_joint_paths(wall.cell, wall.library, far.groups)
    assert not paths and not covered[0].any()
    assert not reachability[0].solved.any()
