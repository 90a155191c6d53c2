"""A simulated job as it is played back: shapes, poses, moments."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

TOP_M = 0.42  # height of the plate that the job is on


def test_the_pad_is_on_the_object_while_it_works(playback):
    orange = [s for s in playback.shapes if s.path == 0 and s.colour[0] > 2 * s.colour[2]]
    (pad,) = orange
    at_work = np.flatnonzero(playback.motion == "process")[20::25]
    for at in at_work:
        turn = Rotation.from_quat(np.roll(playback.quaternions_wxyz[at, pad.body], -1))
        placed = turn.apply(pad.vertices) + playback.positions[at, pad.body]
        about = Rotation.from_euler("z", playback.turntable_rad[at]).as_matrix()
        R, t = about @ playback.T_cell_object[:3, :3], about @ playback.T_cell_object[:3, 3]
        on_object = (placed - t) @ R
        assert on_object[:, 1].min() == pytest.approx(TOP_M, abs=0.006)
        assert np.abs(on_object[:, [0, 2]]).max() < 0.15
    assert len(at_work) > 3 and playback.turntable_rad[at_work[0]] == pytest.approx(0.4)


def test_what_a_playback_holds(playback):
    assert playback.times[0] == 0.0 and (np.diff(playback.times) > 0).all()
    count = len(playback.times)
    assert playback.positions.shape[0] == len(playback.motion) == len(playback.force_n) == count
    assert playback.index_at(-1.0) == 0 and playback.index_at(1e9) == count - 1
    assert playback.times[playback.index_at(3.0)] == pytest.approx(3.0, abs=0.05)
    assert len(playback.unreached) == 0 and playback.report["total"]["reached_share"] == 1.0
    from nrdf.studio.model.playback import EVERY_PATH, FLOOR

    bodies = {shape.body for shape in playback.shapes if shape.path == EVERY_PATH}
    assert FLOOR in bodies and len(bodies) == 8, "six links, the base, and what they stand on"
    lowest = min(s.vertices[:, 2].min() for s in playback.shapes if s.body == FLOOR)
    assert lowest == pytest.approx(0.0), "the floor"
