from __future__ import annotations

import numpy as np

from nrdf.robot.planning.candidates import track_beyond, track_from


def test_candidates_are_tracked_from_the_anchor_to_both_sides(wall):
    covered = [np.zeros(12, bool)]
    made = track_from(wall.cell, wall.library, wall.path.groups, covered, [(0, 5)], tilt=False)
    assert (made.group == 0).all() and made.good[:, 5].all()
    best = int(made.good.sum(axis=1).argmax())
    assert made.good[best, :8].all()
    path = made.joint_path(best, 2, 6)
    assert (path.first, path.last, len(path.joints)) == (2, 6, 5)
    assert np.abs(np.diff(path.joints, axis=0)).max() < 0.6
    np.testing.assert_array_equal(path.axes, wall.path.segments[0].axes[2:7])


def test_what_is_covered_already_is_not_tracked(wall):
    covered = [np.arange(12) < 3]
    made = track_from(wall.cell, wall.library, wall.path.groups, covered, [(0, 5)], tilt=False)
    assert not made.good[:, :3].any() and made.good[:, 3].any()


def test_joint_paths_are_kept_and_tried_beyond_their_ends(wall, wall_paths):
    path = max(wall_paths[0], key=lambda p: len(p.joints))
    covered = [np.ones(12, bool)]
    made = track_beyond(wall.cell, wall.path.groups, [path], covered)
    part = slice(path.first, path.last + 1)
    assert len(made.group) == 2
    for row in (0, 1):
        np.testing.assert_array_equal(made.joints[row, part], path.joints)
        assert made.good[row].sum() == len(path.joints)
